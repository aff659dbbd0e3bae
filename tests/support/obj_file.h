// Wavefront OBJ files of the repository as meshes: vertices and faces, polygons as fans of
// triangles like client/src/scenes/mesh_file.cpp. Header only, for files that are known to be good.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "server/scene/description.h"

namespace drape::test {

inline TriangleMesh ReadObj(const std::filesystem::path& path, double scale_m) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error("cannot read " + path.string());
  TriangleMesh mesh;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (word == "v") {
      Eigen::Vector3d p;
      words >> p.x() >> p.y() >> p.z();
      mesh.positions_m.push_back(scale_m * p);
    } else if (word == "f") {
      std::vector<uint32_t> corners;  // "7", "7/1" or "7/1/2": the vertex comes first
      while (words >> word) corners.push_back(static_cast<uint32_t>(std::stoul(word)) - 1);
      for (size_t k = 2; k < corners.size(); ++k) {
        mesh.triangles.push_back({corners[0], corners[k - 1], corners[k]});
      }
    }
  }
  return mesh;
}

}  // namespace drape::test
