from glob import glob

from setuptools import find_packages, setup

PACKAGE = 'conveyor_sim'

setup(
    name=PACKAGE,
    version='0.1.0',
    packages=find_packages(exclude=['test']),
    package_data={PACKAGE: ['py.typed', 'data/*.csv']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/' + PACKAGE]),
        ('share/' + PACKAGE, ['package.xml']),
        ('share/' + PACKAGE + '/config', glob('config/*.yaml')),
        ('share/' + PACKAGE + '/launch', glob('launch/*.launch.py')),
    ],
    python_requires='>=3.10',
    install_requires=['openpyxl', 'pack_msgs_py', 'PyYAML'],
    extras_require={'test': ['pytest', 'hypothesis']},
    zip_safe=False,
    maintainer='Packing cell maintainers',
    maintainer_email='maintainers@packing-cell.example.org',
    description='Box streams, circular belt, scanner and durable ledger of the packing cell',
    license='Apache-2.0',
    entry_points={'console_scripts': ['conveyor = conveyor_sim.main:main']},
)
