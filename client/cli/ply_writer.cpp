// PLY, the polygon format of Stanford, as text.
#include <algorithm>
#include <string>
#include <utility>

#include "client/cli/geometry_writer.h"

namespace drape::cli {
namespace {

bool HasVelocities(const States& states) {
  return std::any_of(states.begin(), states.end(),
                     [](const ClothState& cloth) { return !cloth.velocities_m_per_s.empty(); });
}

std::string PlyHeader(const States& states, const std::vector<Topology>& topologies) {
  uint64_t vertex_count = 0;
  uint64_t face_count = 0;
  uint64_t edge_count = 0;
  bool is_float64 = false;
  for (size_t index = 0; index < states.size(); ++index) {
    vertex_count += states[index].particle_count;
    face_count += TopologyAt(topologies, index).triangles.size();
    edge_count += TopologyAt(topologies, index).lines.size();
    is_float64 = is_float64 || states[index].positions_m.is_float64();
  }
  const std::string type = is_float64 ? "double" : "float";
  std::string text = "ply\nformat ascii 1.0\ncomment Drape: metres, metres per second, +Y up\n";
  text += "element vertex " + std::to_string(vertex_count) + "\n";
  for (const char* axis : {"x", "y", "z"}) text += "property " + type + " " + axis + "\n";
  text += "property uint cloth\n";
  if (HasVelocities(states)) {
    for (const char* axis : {"vx", "vy", "vz"}) text += "property " + type + " " + axis + "\n";
  }
  text += "element face " + std::to_string(face_count) + "\n";
  text += "property list uchar uint vertex_indices\n";
  if (edge_count > 0) {
    text += "element edge " + std::to_string(edge_count) + "\n";
    text += "property uint vertex1\nproperty uint vertex2\n";
  }
  return text + "end_header\n";
}

void WriteVertices(const States& states, OutputFile& file) {
  for (size_t index = 0; index < states.size(); ++index) {
    const ClothState& cloth = states[index];
    std::string text;
    for (size_t particle = 0; particle < cloth.particle_count; ++particle) {
      AppendVector(cloth.positions_m, particle, &text);
      text += ' ' + std::to_string(index);
      if (!cloth.velocities_m_per_s.empty()) {
        text += ' ';
        AppendVector(cloth.velocities_m_per_s, particle, &text);
      }
      text += '\n';
    }
    file.Write(text);
  }
}

// One line per element of all cloths: `prefix`, then the indices.
template <class Elements>
void WriteElements(const States& states, const std::vector<Topology>& topologies,
                   const std::string& prefix, Elements Topology::*elements, OutputFile& file) {
  uint64_t offset = 0;
  for (size_t index = 0; index < states.size(); ++index) {
    std::string text;
    for (const auto& element : TopologyAt(topologies, index).*elements) {
      std::string line;
      AppendIndices(element, offset, &line);
      text += prefix.empty() ? line.substr(1) : prefix + line;
    }
    file.Write(text);
    offset += states[index].particle_count;
  }
}

void WritePly(const States& states, const std::vector<Topology>& topologies, OutputFile& file) {
  file.Write(PlyHeader(states, topologies));
  WriteVertices(states, file);
  WriteElements(states, topologies, "3", &Topology::triangles, file);
  WriteElements(states, topologies, "", &Topology::lines, file);
}

}  // namespace

std::unique_ptr<StateWriter> MakePlyWriter(const std::filesystem::path& path,
                                           StateFileOptions options) {
  return MakeGeometryWriter(path, std::move(options), WritePly);
}

}  // namespace drape::cli
