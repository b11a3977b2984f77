# Every outside library, by the purpose it serves here. All are Debian 12 packages.
find_package(PkgConfig REQUIRED)
find_package(Threads REQUIRED)

find_package(fmt REQUIRED)
find_package(spdlog REQUIRED)
find_package(nlohmann_json REQUIRED)

add_library(lib_opencl INTERFACE)
find_package(OpenCL REQUIRED)
target_link_libraries(lib_opencl INTERFACE OpenCL::OpenCL)
target_compile_definitions(lib_opencl INTERFACE
  CL_HPP_TARGET_OPENCL_VERSION=300 CL_HPP_MINIMUM_OPENCL_VERSION=200 CL_TARGET_OPENCL_VERSION=300
  CL_HPP_ENABLE_EXCEPTIONS)

add_library(lib_clblast INTERFACE)
find_library(CLBLAST_LIBRARY clblast REQUIRED)
target_link_libraries(lib_clblast INTERFACE ${CLBLAST_LIBRARY} lib_opencl)

add_library(lib_images INTERFACE)
pkg_check_modules(OIIO REQUIRED IMPORTED_TARGET OpenImageIO)
pkg_check_modules(OPENEXR REQUIRED IMPORTED_TARGET OpenEXR)
target_link_libraries(lib_images INTERFACE PkgConfig::OIIO PkgConfig::OPENEXR)

add_library(lib_scene_files INTERFACE)
find_path(STB_INCLUDE stb_image.h PATH_SUFFIXES stb REQUIRED)
find_library(DRACO_LIBRARY draco REQUIRED)
target_include_directories(lib_scene_files SYSTEM INTERFACE ${STB_INCLUDE})
target_compile_definitions(lib_scene_files INTERFACE TINYGLTF_ENABLE_DRACO)
target_link_libraries(lib_scene_files INTERFACE ${DRACO_LIBRARY})

add_library(lib_config_files INTERFACE)   # toml++ and nlohmann-json are headers only
target_link_libraries(lib_config_files INTERFACE nlohmann_json::nlohmann_json)

add_library(lib_hdf5 INTERFACE)
pkg_check_modules(HDF5 REQUIRED IMPORTED_TARGET hdf5)
target_link_libraries(lib_hdf5 INTERFACE PkgConfig::HDF5)

add_library(lib_bvh_builder INTERFACE)
find_library(EMBREE_LIBRARY embree3 REQUIRED)
target_link_libraries(lib_bvh_builder INTERFACE ${EMBREE_LIBRARY})

add_library(lib_command_line INTERFACE)   # CLI11 is headers only
