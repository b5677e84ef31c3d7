"""Build script of the ament_python package; pip reads the root's pyproject.toml instead."""

from setuptools import find_packages, setup

PACKAGE = 'goalreach_msgs_py'

setup(
    name=PACKAGE,
    version='0.1.0',
    packages=find_packages(),
    package_data={PACKAGE: ['py.typed', 'config/*', 'config/arenas/*']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (f'share/{PACKAGE}', ['package.xml']),
    ],
    install_requires=['setuptools'],
    extras_require={'test': ['pytest']},
    zip_safe=False,
    author='The goalreach authors',
    author_email='goalreach@example.org',
    maintainer='The goalreach authors',
    maintainer_email='goalreach@example.org',
    description='Value types, camera model, topics and message codecs of goalreach',
    license='Apache-2.0',
)
