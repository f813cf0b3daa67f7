# SPDX-License-Identifier: Apache-2.0
"""Builds and runs the program that tests/packaging builds in other ways."""
import os

from conan import ConanFile
from conan.tools.build import can_run
from conan.tools.cmake import CMake, CMakeDeps, CMakeToolchain, cmake_layout


class GsnavTest(ConanFile):
    settings = "os", "arch", "compiler", "build_type"

    def requirements(self):
        self.requires(self.tested_reference_str)

    def layout(self):
        cmake_layout(self)

    def generate(self):
        CMakeDeps(self).generate()
        toolchain = CMakeToolchain(self)
        toolchain.user_presets_path = False  # nothing is written among the sources
        options = self.dependencies["gsnav"].options
        wanted = ["openmp", "avatar", "rigging", "demo", "eval"]
        wanted += ["io"] if options.io else []
        wanted += ["nav", "sim", "device"] if options.sim else []
        toolchain.cache_variables["WANTED"] = ",".join(wanted)
        toolchain.cache_variables["EXPECTED_VERSION"] = str(self.dependencies["gsnav"].ref.version)
        toolchain.generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def test(self):
        if can_run(self):
            self.run(os.path.join(self.cpp.build.bindir, "find_package", "consumer"), env="conanrun")
