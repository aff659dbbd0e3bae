# What `cmake --install` and `cpack` put where. Two components: `runtime` (programs) and `development` (the client
# library for find_package(Drape), the protocol). Shaders and fonts are inside the programs.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(drape_cmake_dir ${CMAKE_INSTALL_LIBDIR}/cmake/Drape)
set(drape_libraries drape_proto drape_client)
set(drape_headers ${PROJECT_SOURCE_DIR}/client/include/)
set(excluded_headers)
if(DRAPE_SERVER)
  list(APPEND drape_libraries drape_scenes)
else()
  set(excluded_headers REGEX "/(mesh_file|scene_file|scene_player)\\.h$" EXCLUDE)
endif()

# Drape::client, Drape::scenes, Drape::proto
foreach(library IN LISTS drape_libraries)
  string(REPLACE "drape_" "" name ${library})
  set_target_properties(${library} PROPERTIES EXPORT_NAME ${name})
endforeach()
install(TARGETS ${drape_libraries} EXPORT DrapeTargets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development
  INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(DIRECTORY ${drape_headers} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development ${excluded_headers})
# Without google/rpc: no header of ours includes it, and other packages bring it too.
install(DIRECTORY ${PROJECT_BINARY_DIR}/proto/gen/drape DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development
  FILES_MATCHING PATTERN "*.h")
install(DIRECTORY ${PROJECT_SOURCE_DIR}/proto/drape ${PROJECT_SOURCE_DIR}/proto/google
  DESTINATION ${CMAKE_INSTALL_DATADIR}/drape/proto COMPONENT development FILES_MATCHING PATTERN "*.proto" PATTERN "LICENSE")

install(EXPORT DrapeTargets NAMESPACE Drape:: DESTINATION ${drape_cmake_dir} COMPONENT development)
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/DrapeConfig.cmake.in
  ${PROJECT_BINARY_DIR}/DrapeConfig.cmake INSTALL_DESTINATION ${drape_cmake_dir}
  PATH_VARS CMAKE_INSTALL_BINDIR)
# Until 1.0 a minor version may change anything.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/DrapeConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/DrapeConfig.cmake ${PROJECT_BINARY_DIR}/DrapeConfigVersion.cmake
  DESTINATION ${drape_cmake_dir} COMPONENT development)

if(DRAPE_SERVER)
  install(TARGETS draped drape RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT runtime)
  install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT runtime)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/client/examples/ DESTINATION ${CMAKE_INSTALL_DATADIR}/drape/examples
    COMPONENT runtime FILES_MATCHING PATTERN "*.json" PATTERN "meshes/*" PATTERN "pictures" EXCLUDE)
endif()

# Two Debian packages: `cpack -G DEB` in the build folder.
set(CPACK_PACKAGE_VENDOR "Drape")
set(CPACK_PACKAGE_CONTACT "the authors of Drape")
set(CPACK_PACKAGE_FILE_NAME drape)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_COMPONENTS_ALL development)
if(DRAPE_SERVER)
  list(APPEND CPACK_COMPONENTS_ALL runtime)
endif()
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_NAME drape)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SECTION science)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SHLIBDEPS ON)
# Opened at run time: without a GPU, --backend=gl and pictures are computed by Mesa.
set(CPACK_DEBIAN_RUNTIME_PACKAGE_RECOMMENDS "libegl1, libegl-mesa0, libgl1-mesa-dri, libopengl0")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libdrape-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "libgrpc++-dev, libprotobuf-dev")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SUGGESTS "drape")
set(CPACK_COMPONENT_RUNTIME_DESCRIPTION "Cloth-simulation server draped and its command line drape")
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "C++ client library of the cloth-simulation server Drape")
include(CPack)
