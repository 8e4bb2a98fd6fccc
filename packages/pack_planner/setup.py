from glob import glob
from pathlib import Path

from setuptools import find_packages, setup

PACKAGE = 'pack_planner'


def own_dependency(package: str) -> str:
    """How to get a package of this repository, which no package index has.

    From the folder beside this one, so that `pip install ./packages/pack_planner` is enough. An
    sdist stands alone, and what is built from it asks for the other by its name.
    """
    folder = Path(__file__).resolve().parent.parent / package
    return f'{package} @ {folder.as_uri()}' if (folder / 'setup.py').exists() else package


setup(
    name=PACKAGE,
    version='0.1.0',
    packages=find_packages(exclude=['test']),
    package_data={PACKAGE: ['py.typed', 'algorithms/*.json']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/' + PACKAGE]),
        ('share/' + PACKAGE, ['package.xml']),
        ('share/' + PACKAGE + '/config', glob('config/*.yaml')),
        ('share/' + PACKAGE + '/launch', glob('launch/*.launch.py')),
    ],
    python_requires='>=3.10',
    install_requires=[own_dependency('pack_msgs_py'), 'numpy', 'numba>=0.58'],
    extras_require={
        'plot': ['matplotlib'],
        'solvers': ['ortools'],
        'test': ['pytest', 'hypothesis'],
    },
    # numba caches compiled code beside the source, which a zipped package has no room for
    zip_safe=False,
    maintainer='Packing cell maintainers',
    maintainer_email='maintainers@packing-cell.example.org',
    description='Packing engine, packing algorithms and the planner node',
    license='Apache-2.0',
    entry_points={'console_scripts': ['planner = pack_planner.main:main']},
)
