# Debian packages by `cpack`: clerestory, and clerestory-dev with headers and the CMake package.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME clerestory)
set(CPACK_PACKAGE_VENDOR "The Clerestory developers")
set(CPACK_PACKAGE_CONTACT "${CLERESTORY_MAINTAINER}")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "lights a sphere with a photographed environment")
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL clerestory dev)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)

set(CPACK_DEBIAN_CLERESTORY_PACKAGE_NAME clerestory)
set(CPACK_DEBIAN_CLERESTORY_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_CLERESTORY_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_CLERESTORY_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/cmake/debian/triggers)
# The loader is a library and found by itself; a driver is not, nor is the plotter, which is started as a program.
set(CPACK_DEBIAN_CLERESTORY_PACKAGE_DEPENDS "pocl-opencl-icd | opencl-icd, gnuplot-nox | gnuplot")
set(CPACK_COMPONENT_CLERESTORY_DESCRIPTION
"Reads a latitude-longitude HDR map, draws samples of it in proportion to
its light, marks them on the map, shades a diffuse sphere with them, and
says how much error each second bought. Its kernels are OpenCL and run on
the CPU through PoCL, or on any other OpenCL device.")

set(CPACK_DEBIAN_DEV_PACKAGE_NAME clerestory-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS "clerestory (= ${PROJECT_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE})")
set(CPACK_COMPONENT_DEV_DESCRIPTION
"Headers and the CMake package of Clerestory's library, for programs that
load a map, draw samples of it and light a sphere with it themselves.")
include(CPack)
