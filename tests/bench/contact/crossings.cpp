#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <vector>

#include "server/solver/self_contact/crossing_search.h"
#include "tests/bench/contact/contact.h"
#include "tests/support/scenes.h"

namespace drape::bench {

using self_contact::Vector3d;

int CountCrossings(const std::string& path, uint32_t side) {
  const test::Scene scene = test::Grid(side, side, 1, 1);
  const ContactSurface surface(*scene.model);
  const uint32_t count = scene.model->particle_count();
  std::ifstream file(path, std::ios::binary);
  std::vector<float> frame(3 * size_t{count});
  const auto bytes = static_cast<std::streamsize>(frame.size() * sizeof(float));
  std::vector<Vector3d> positions(count);
  for (uint32_t frames = 0; file; ++frames) {
    file.read(reinterpret_cast<char*>(frame.data()), bytes);
    if (file.gcount() == 0 && frames > 0) return 0;
    if (file.gcount() != bytes) break;
    for (uint32_t i = 0; i < count; ++i) {
      positions[i] = Vector3d{frame[3 * i], frame[3 * i + 1], frame[3 * i + 2], 0};
    }
    double strain = 0;
    for (const DistanceConstraint& link : scene.model->constraints()) {
      const double length_m = self_contact::Length(Vector3d(positions[link.j] - positions[link.i]));
      strain = std::max(strain, std::abs(length_m / link.rest_length_m - 1));
    }
    std::printf("%zu %.6g\n", self_contact::FindCrossings(surface, positions).size(), strain);
  }
  std::fprintf(stderr, "%s: no frames of %u x %u particles\n", path.c_str(), side, side);
  return 1;
}

}  // namespace drape::bench
