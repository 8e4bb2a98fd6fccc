"""The belt as a camera sees it: which boxes there are, what they measure, which can be grasped.

A box is measured by the first detections of it and keeps that size: planner and executor tell a
box that was measured otherwise from the one that they have decided about.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from pack_cell.detections.detection import Detection, as_it_lies
from pack_cell.detections.parameters import DetectionParameters
from pack_msgs_py.cell_values import BoxEvent, Decision, Scan, ScannedBox
from pack_msgs_py.codes import BoxEventKind, PlacementStatus, Reason
from pack_msgs_py.geometry.pose import Pose, extent, metres
from pack_msgs_py.values import UP_ANY, UP_POS_Z, Box, Vec3, check_box

#: A box lies still as long as its middle stays within this.
STILL_M = 0.005
#: Boxes that have left the belt are remembered by id, so many of them.
_REMEMBERED = 1000

_LEFT = (BoxEventKind.PICKED, BoxEventKind.PLACED, BoxEventKind.REJECTED, BoxEventKind.LOST)


@dataclass
class _Track:
    """One box on the belt; stamps are seconds since the epoch."""

    pose: Pose
    seen_s: float
    still_at: Pose
    still_since_s: float
    samples: list[Vec3] = field(default_factory=list)
    box: Box | None = None
    laps: int = 0


class DetectionTracker:
    """Makes scans of detections; frame `cell`.

    Parameters
    ----------
    parameters : of the node.
    articles : a box of each article by its name: weight, flags and what else is known of it.
    guide_y_m : where the front of a box is that lies against the guide of the pick point.
    """

    def __init__(
        self,
        parameters: DetectionParameters,
        articles: Mapping[str, Box] | None = None,
        guide_y_m: float = 0.55,
    ) -> None:
        self.parameters = parameters
        self._articles = articles or {}
        self._guide_y_m = guide_y_m
        self._tracks: dict[str, _Track] = {}
        self._left: dict[str, None] = {}
        self._rejected: dict[str, tuple[Reason, str]] = {}
        self._refused: dict[str, str] = {}
        self._sequence = 0
        self._supplied = 0

    def on_detections(self, detections: Iterable[Detection], stamp_s: float) -> list[str]:
        """An image; returns what has to be told of it, once for each box."""
        told = []
        for seen in detections:
            if seen.score < self.parameters.min_confidence or seen.id in self._left:
                continue
            pose, size_mm = as_it_lies(seen.pose, seen.size_mm)
            track = self._tracks.get(seen.id)
            if track is None:
                track = self._tracks[seen.id] = _Track(pose, stamp_s, pose, stamp_s)
            track.pose, track.seen_s = pose, stamp_s
            if math.dist(track.still_at.position, pose.position) > STILL_M:
                track.still_at, track.still_since_s = pose, stamp_s
            if track.box is None:
                track.samples.append(size_mm)
                if len(track.samples) >= self.parameters.samples:
                    why = self._measure(seen, track)
                    if why and self._refused.get(seen.id) != why:
                        self._refused[seen.id] = why
                        told.append(why)
        return told

    def _measure(self, seen: Detection, track: _Track) -> str:
        """Make a box of what was detected; returns why there is none."""
        samples, sigma_mm = track.samples, self.parameters.size_sigma
        track.samples = []
        edges = list(zip(*samples, strict=True))
        x, y, z = (statistics.median(edge) for edge in edges)
        sx, sy, sz = (
            max(sigma_mm, statistics.stdev(edge) if len(edge) > 1 else 0.0) for edge in edges
        )
        article = self._articles.get(seen.class_id) or self._articles.get(seen.id)
        weight_kg = self.parameters.weight if article is None else article.weight_kg
        if weight_kg <= 0.0:
            return (
                f'box {seen.id!r}: article {seen.class_id!r} is not in the list of articles, so '
                'its weight is not known; complete the list, or set the parameter weight'
            )
        known = {} if article is None else dict(article.extra)
        known |= {'sku': seen.class_id} if seen.class_id else {}
        known |= {
            'scan_confidence': f'{seen.score:.3f}',
            'scan_status': 'article unknown' if article is None else 'ok',
        }
        base = article or Box(seen.id, (x, y, z), weight_kg)
        box = Box(
            id=seen.id,
            size_mm=(round(x, 1), round(y, 1), round(z, 1)),
            weight_kg=weight_kg,
            # which of its ends is which a bounding box does not say, but what is up it does
            allowed_up=UP_ANY if base.allowed_up == UP_ANY else UP_POS_Z,
            max_top_load_n=base.max_top_load_n,
            destination=base.destination,
            size_stddev_mm=(sx, sy, sz),
            extra=tuple(known.items()),
        )
        try:
            track.box = check_box(box)
        except ValueError as error:
            return str(error)
        self._supplied += 1
        return ''

    def on_event(self, event: BoxEvent) -> None:
        """What happened to a box: it has left the belt, or has come back to it."""
        if event.event is BoxEventKind.RETURNED:
            self._left.pop(event.box_id, None)
            return
        if event.event not in _LEFT:
            return
        self._leave(event.box_id)
        if event.event is BoxEventKind.PICKED:
            for track in self._tracks.values():
                track.laps += track.box is not None

    def on_decision(self, decision: Decision) -> None:
        """A decision of the planner: a rejected box is to be taken off by whoever runs the belt."""
        if decision.status is PlacementStatus.REJECT and decision.box.id in self._tracks:
            self._rejected[decision.box.id] = (decision.reject_reason, decision.reason)

    def forget(self, now_s: float) -> list[BoxEvent]:
        """Boxes that have gone; returns the events of those that were to be taken off."""
        events = []
        for box_id, track in list(self._tracks.items()):
            if now_s - track.seen_s <= self.parameters.forget_time:
                continue
            del self._tracks[box_id]
            if box_id in self._rejected:
                reason, text = self._rejected[box_id]
                kind = BoxEventKind.REJECTED
                events.append(BoxEvent(box_id, kind, reason, text, stamp_s=now_s))
                self._leave(box_id)
        return events

    def scan(self, now_s: float) -> Scan:
        """The belt now, nearest box first; each call has the next sequence number."""
        # So it also grows over a restart.
        self._sequence = max(self._sequence + 1, round(now_s))
        boxes = [
            ScannedBox(
                track.box,
                track.pose,
                pick_open_s=self._opens_s(track.box, track, now_s),
                laps=track.laps,
            )
            for track in self._tracks.values()
            if track.box is not None
        ]
        boxes.sort(key=lambda item: item.pose.position[1])
        return Scan(self._sequence, now_s, tuple(boxes), supplied=self._supplied, remaining=-1)

    def _opens_s(self, box: Box, track: _Track, now_s: float) -> float | None:
        """Since when a box can be grasped; ``None`` while it moves, or is not there yet."""
        front_y = extent(track.pose, metres(box.size_mm))[0][1]
        near = front_y <= self._guide_y_m + self.parameters.pick_depth
        opens_s = track.still_since_s + self.parameters.still_time
        return opens_s if near and opens_s <= now_s else None

    def _leave(self, box_id: str) -> None:
        self._tracks.pop(box_id, None)
        self._rejected.pop(box_id, None)
        self._refused.pop(box_id, None)
        self._left.pop(box_id, None)
        self._left[box_id] = None
        while len(self._left) > _REMEMBERED:
            del self._left[next(iter(self._left))]
