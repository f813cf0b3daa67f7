# SPDX-License-Identifier: Apache-2.0
"""Builds the tree it lies in: conan create cmake/packaging/conan --build=missing"""
import os
import re

from conan import ConanFile
from conan.tools.build import check_min_cppstd
from conan.tools.cmake import CMake, CMakeDeps, CMakeToolchain, cmake_layout
from conan.tools.files import copy, load

required_conan_version = ">=2.0"


class Gsnav(ConanFile):
    name = "gsnav"
    description = "Gaussian splatting and navigation simulation for C++20"
    license = "Apache-2.0"
    topics = ("gaussian-splatting", "navigation", "simulation", "rendering")
    package_type = "library"
    settings = "os", "arch", "compiler", "build_type"
    options = {
        "shared": [True, False],
        "fPIC": [True, False],
        "io": [True, False],     # gsnav::io: files of scenes, people and meshes
        "sim": [True, False],    # gsnav::nav, gsnav::sim and gsnav::device
        "tools": [True, False],  # the programs; they need io and sim
        "cuda": [True, False],   # gsnav::cuda; nvcc 12 or later must be installed
    }
    default_options = {"shared": False, "fPIC": True, "io": True, "sim": True, "tools": False, "cuda": False}

    def _root(self):
        return os.path.join(self.recipe_folder, "..", "..", "..")

    def set_version(self):
        header = load(self, os.path.join(self._root(), "include", "gsnav", "version.hpp"))
        self.version = ".".join(re.findall(r"#define GSNAV_VERSION_\w+ (\d+)", header))

    def export_sources(self):
        for folder in ("backends", "cmake", "examples", "include", "src", "tools"):
            copy(self, f"{folder}/*", self._root(), self.export_sources_folder)
        for file in ("CMakeLists.txt", "CHANGELOG.md", "LICENSE"):
            copy(self, file, self._root(), self.export_sources_folder)

    def configure(self):
        if self.options.shared:
            self.options.rm_safe("fPIC")
        if self.options.tools:
            self.options.io = True
            self.options.sim = True

    def requirements(self):
        # Programs that link a static gsnav find these too, by find_package.
        if self.options.io:
            self.requires("libpng/[>=1.6 <2]", transitive_headers=True)
            self.requires("libjpeg/[>=9e]", transitive_headers=True)
            self.requires("libwebp/[>=1.2 <2]", transitive_headers=True)
            self.requires("zlib/[>=1.2.11 <2]", transitive_headers=True)
            self.requires("zstd/[>=1.5 <2]", transitive_headers=True)
            self.requires("nlohmann_json/[>=3.11 <4]", visible=False)
        if self.options.sim:
            self.requires("recastnavigation/[>=1.5 <2]", transitive_headers=True)
        if self.options.tools:
            self.requires("cli11/[>=2.3 <3]", visible=False)

    def validate(self):
        check_min_cppstd(self, 20)

    def layout(self):
        cmake_layout(self)

    def generate(self):
        CMakeDeps(self).generate()
        toolchain = CMakeToolchain(self)
        toolchain.user_presets_path = False  # nothing is written among the sources
        for component, option in (("IO", "io"), ("NAV", "sim"), ("SIM", "sim"), ("TOOLS", "tools"), ("CUDA", "cuda")):
            toolchain.cache_variables[f"GSNAV_{component}"] = bool(self.options.get_safe(option))
        toolchain.cache_variables["GSNAV_EXAMPLES"] = False
        toolchain.generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def package(self):
        CMake(self).install()
        copy(self, "LICENSE", self.source_folder, os.path.join(self.package_folder, "licenses"))

    def package_info(self):
        # find_package(gsnav COMPONENTS ...) finds the files that gsnav installs itself.
        self.cpp_info.set_property("cmake_find_mode", "none")
        self.cpp_info.builddirs = [os.path.join("lib", "cmake", "gsnav")]
