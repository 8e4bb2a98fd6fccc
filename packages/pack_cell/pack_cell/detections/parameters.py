"""Parameters of the node `detection_scanner`."""

from __future__ import annotations

from dataclasses import dataclass

from pack_msgs_py.parameter_fields import parameter


@dataclass(frozen=True)
class DetectionParameters:
    """What an operator can set; see the table in the README."""

    min_confidence: float = parameter(
        0.5, 'Detections with a lower score are not looked at.', low=0.0, high=1.0
    )
    samples: int = parameter(
        5,
        'A box is offered once it was detected so often; its edges are the medians of these.',
        low=1,
        high=1000,
    )
    size_sigma: float = parameter(
        1.0,
        'Standard deviation of an edge, where the detections differ less.',
        unit='mm',
        low=0.0,
        high=50.0,
    )
    articles: str = parameter(
        '',
        'Box list with weights and flags by article: the class of a detection is its `sku`, or its '
        'id where it has none. Any list that `cell boxes` reads; empty for none.',
        read_only=True,
    )
    weight: float = parameter(
        0.0,
        'Weight of a box whose article is not in the list; 0: it is not offered.',
        unit='kg',
        low=0.0,
        high=100.0,
    )
    pick_depth: float = parameter(
        0.10,
        'A box whose front is at most so far behind the guide can be grasped, once it lies still.',
        unit='m',
        low=0.0,
        high=0.3,
    )
    still_time: float = parameter(
        0.3,
        'A box lies still when its middle has not moved by more than 5 mm for so long.',
        unit='s',
        low=0.0,
        high=10.0,
    )
    forget_time: float = parameter(
        3.0,
        'A box that was not detected for so long has gone; until then the arm may hide it.',
        unit='s',
        low=0.1,
        high=60.0,
    )
    frame_prefix: str = parameter(
        '',
        'Stands before the name of every frame on `/tf`, such as `north/`, where several cells '
        'share it; frames in the messages of the cell keep their names.',
        read_only=True,
    )
