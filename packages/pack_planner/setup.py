from glob import glob

from setuptools import find_packages, setup

PACKAGE = 'pack_planner'

setup(
    name=PACKAGE,
    version='0.1.0',
    packages=find_packages(exclude=['test']),
    package_data={PACKAGE: ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/' + PACKAGE]),
        ('share/' + PACKAGE, ['package.xml']),
        ('share/' + PACKAGE + '/config', glob('config/*.yaml')),
    ],
    install_requires=['setuptools'],
    extras_require={'test': ['pytest', 'hypothesis']},
    # numba caches compiled code beside the source, which a zipped package has no room for
    zip_safe=False,
    maintainer='Packing cell maintainers',
    maintainer_email='maintainers@packing-cell.example.org',
    description='Packing engine, packing algorithms and the planner node',
    license='Apache-2.0',
    entry_points={'console_scripts': ['planner = pack_planner.main:main']},
)
