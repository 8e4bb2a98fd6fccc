from glob import glob

from setuptools import find_packages, setup

PACKAGE = 'pack_cell'
_WEB = ('css', 'html', 'js')
_ROOMS = ('pages', 'replay', 'report_page', 'view', 'what_if')

setup(
    name=PACKAGE,
    version='0.1.0',
    packages=find_packages(exclude=['test']),
    package_data={
        PACKAGE: [
            'py.typed',
            'bench/data/*.csv',
            *(f'{room}/*.{kind}' for room in _ROOMS for kind in _WEB),
        ]
    },
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/' + PACKAGE]),
        ('share/' + PACKAGE, ['package.xml']),
        ('share/' + PACKAGE + '/launch', glob('launch/*.launch.py')),
        ('share/' + PACKAGE + '/config', glob('config/*')),
    ],
    python_requires='>=3.10',
    install_requires=[
        'arm_executor',
        'cmaes',
        'conveyor_sim',
        'Jinja2',
        'joblib',
        'MarkupSafe',
        'matplotlib',
        'mcap',
        'numpy',
        'pack_msgs_py',
        'pack_planner',
        'Pillow',
        'PyYAML',
        'rich',
        'scipy',
        'shtab',
        'viser',
        'websockets',
    ],
    extras_require={
        'cluster': ['distributed'],
        'test': ['pytest'],
    },
    zip_safe=True,
    maintainer='Packing cell maintainers',
    maintainer_email='maintainers@packing-cell.example.org',
    description='Launch files, configuration, supervisor, recorder, report, command line',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'cell = pack_cell.__main__:main',
            'cell_monitor = pack_cell.ros.cell_monitor:main',
            'detection_scanner = pack_cell.ros.detection_scanner:main',
            'end_of_stream = pack_cell.ros.end_of_stream:main',
            'recorder = pack_cell.ros.recorder:main',
            'topic_recorder = pack_cell.ros.topic_recorder:main',
            'viewer = pack_cell.ros.viewer:main',
        ]
    },
)
