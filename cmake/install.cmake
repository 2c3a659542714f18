# What `cmake --install` puts where. Two components, a Debian package each: `clerestory` runs, `dev` builds other programs.
include(CMakePackageConfigHelpers)
# Whatever the umask: in folders that a group may write to, programs compiled ahead would not be used (src/base/trust.hpp).
set(CMAKE_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(cmake_dir ${CMAKE_INSTALL_LIBDIR}/cmake/clerestory)

install(TARGETS clerestory RUNTIME COMPONENT clerestory)
install(TARGETS clerestory_shared EXPORT clerestory
        LIBRARY COMPONENT clerestory NAMELINK_COMPONENT dev)
install(TARGETS clerestory_oiio LIBRARY DESTINATION ${CLERESTORY_MODULE_DIR} COMPONENT clerestory)
if(CLERESTORY_PRECOMPILE)
  install(DIRECTORY ${precompiled} DESTINATION ${CLERESTORY_MODULE_DIR} COMPONENT clerestory)
endif()
install(DIRECTORY data/ DESTINATION ${CLERESTORY_DATA_DIR} COMPONENT clerestory)
install(DIRECTORY ${described}/man1 DESTINATION ${CMAKE_INSTALL_MANDIR} COMPONENT clerestory FILES_MATCHING PATTERN "*.gz")
install(FILES ${described}/completions/clerestory DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions COMPONENT clerestory)
install(FILES ${described}/completions/_clerestory DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions COMPONENT clerestory)
install(FILES ${described}/completions/clerestory.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d COMPONENT clerestory)

install(DIRECTORY include/clerestory DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT dev)
install(EXPORT clerestory NAMESPACE clerestory:: DESTINATION ${cmake_dir} FILE clerestory-config.cmake COMPONENT dev)
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/clerestory-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/clerestory-config-version.cmake DESTINATION ${cmake_dir} COMPONENT dev)
install(FILES examples/CMakeLists.txt examples/sphere.cpp DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/clerestory-dev/examples COMPONENT dev)
# Debian wants an address of whoever made a package: theirs, by the variables of Debian's own tools. The project has none, and .invalid is
# reserved for saying so.
set(maintainer "The Clerestory developers <clerestory@example.invalid>")
if(DEFINED ENV{DEBEMAIL} AND DEFINED ENV{DEBFULLNAME})
  set(maintainer "$ENV{DEBFULLNAME} <$ENV{DEBEMAIL}>")
endif()
set(CLERESTORY_MAINTAINER "${maintainer}" CACHE STRING "Who the Debian packages name as their maintainer: NAME <ADDRESS>")
string(TIMESTAMP date "%a, %d %b %Y %H:%M:%S +0000" UTC)
file(CONFIGURE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/changelog.Debian @ONLY CONTENT [[
clerestory (@PROJECT_VERSION@-1) unstable; urgency=medium

  * Release @PROJECT_VERSION@: see CHANGELOG.md of the source.

 -- @CLERESTORY_MAINTAINER@  @date@
]])
execute_process(COMMAND gzip -9nkf ${CMAKE_CURRENT_BINARY_DIR}/changelog.Debian COMMAND_ERROR_IS_FATAL ANY)
# Licence and history where Debian looks for them, for both packages.
foreach(component clerestory dev)
  string(REPLACE "clerestory-clerestory" clerestory package clerestory-${component})
  set(doc_dir ${CMAKE_INSTALL_DATADIR}/doc/${package})
  install(FILES cmake/debian/copyright DESTINATION ${doc_dir} COMPONENT ${component})
  install(FILES ${CMAKE_CURRENT_BINARY_DIR}/changelog.Debian.gz DESTINATION ${doc_dir} COMPONENT ${component})
endforeach()
