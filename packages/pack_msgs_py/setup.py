from setuptools import find_packages, setup

PACKAGE = 'pack_msgs_py'

setup(
    name=PACKAGE,
    version='0.1.0',
    packages=find_packages(exclude=['test']),
    package_data={PACKAGE: ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/' + PACKAGE]),
        ('share/' + PACKAGE, ['package.xml']),
    ],
    python_requires='>=3.10',
    install_requires=[],
    extras_require={'test': ['pytest', 'hypothesis']},
    zip_safe=True,
    maintainer='Packing cell maintainers',
    maintainer_email='maintainers@packing-cell.example.org',
    description='Values, packing rules, validation and conversions of the packing cell',
    license='Apache-2.0',
)
