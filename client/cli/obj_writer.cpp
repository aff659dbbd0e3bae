// Wavefront OBJ.
#include <string>
#include <utility>

#include "client/cli/geometry_writer.h"

namespace drape::cli {
namespace {

void AppendElements(const Topology& topology, size_t particle_count, uint64_t offset,
                    std::string* text) {
  for (const auto& triangle : topology.triangles) {
    *text += 'f';
    AppendIndices(triangle, offset, text);
  }
  for (const auto& line : topology.lines) {
    *text += 'l';
    AppendIndices(line, offset, text);
  }
  if (!topology.triangles.empty() || !topology.lines.empty()) return;
  for (uint32_t particle = 0; particle < particle_count; ++particle) {
    *text += 'p';
    AppendIndices({&particle, 1}, offset, text);
  }
}

void WriteObj(const States& states, const std::vector<Topology>& topologies, OutputFile& file) {
  file.Write("# Drape: metres, +Y up\n");
  uint64_t offset = 1;  // indices of the format count from 1 through the whole file
  for (size_t index = 0; index < states.size(); ++index) {
    const ClothState& cloth = states[index];
    std::string text = "o cloth_" + std::to_string(index) + "\n";
    for (size_t particle = 0; particle < cloth.particle_count; ++particle) {
      text += "v ";
      AppendVector(cloth.positions_m, particle, &text);
      text += '\n';
    }
    AppendElements(TopologyAt(topologies, index), cloth.particle_count, offset, &text);
    file.Write(text);
    offset += cloth.particle_count;
  }
}

}  // namespace

std::unique_ptr<StateWriter> MakeObjWriter(const std::filesystem::path& path,
                                           StateFileOptions options) {
  return MakeGeometryWriter(path, std::move(options), WriteObj);
}

}  // namespace drape::cli
