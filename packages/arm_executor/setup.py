from glob import glob

from setuptools import find_packages, setup

PACKAGE = 'arm_executor'

setup(
    name=PACKAGE,
    version='0.1.0',
    packages=find_packages(exclude=['test']),
    package_data={PACKAGE: ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/' + PACKAGE]),
        ('share/' + PACKAGE, ['package.xml']),
        ('share/' + PACKAGE + '/config', glob('config/*.yaml')),
        ('share/' + PACKAGE + '/launch', glob('launch/*.launch.py')),
    ],
    python_requires='>=3.10',
    install_requires=['pack_msgs_py', 'numpy', 'numba>=0.58', 'PyYAML'],
    extras_require={
        'physics': ['pin', 'pybullet', 'toppra'],
        'test': ['pytest', 'hypothesis'],
    },
    # numba caches compiled code beside the source, which a zipped package has no room for
    zip_safe=False,
    maintainer='Packing cell maintainers',
    maintainer_email='maintainers@packing-cell.example.org',
    description='Robot model, motion, physics world, bin journal and the place_box action',
    license='Apache-2.0',
    entry_points={'console_scripts': ['arm_executor = arm_executor.main:main']},
)
