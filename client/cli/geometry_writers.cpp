// OBJ and PLY: the last state as geometry.
#include <string>
#include <utility>

#include "client/cli/output_file.h"
#include "client/cli/state_writers.h"

namespace drape::cli {
namespace {

template <class Number>
void AppendVector(std::span<const Number> elements, size_t row, std::string* text) {
  for (size_t axis = 0; axis < 3; ++axis) {
    if (axis > 0) *text += ' ';
    AppendNumber(elements[3 * row + axis], text);
  }
}

void AppendPosition(const ClothState& cloth, size_t row, std::string* text) {
  if (cloth.positions_m.is_float64()) {
    AppendVector(cloth.positions_m.doubles(), row, text);
  } else {
    AppendVector(cloth.positions_m.floats(), row, text);
  }
}

// " a b c", each index shifted by `offset`.
template <size_t count>
void AppendIndices(const std::array<uint32_t, count>& indices, uint64_t offset, std::string* text) {
  for (const uint32_t index : indices) {
    *text += ' ';
    AppendNumber(offset + index, text);
  }
  *text += '\n';
}

class GeometryWriter : public StateWriter {
 public:
  GeometryWriter(const std::filesystem::path& path, std::vector<Topology> topologies)
      : file_(path), topologies_(std::move(topologies)) {}

  bool takes_samples() const override { return false; }
  void Finish() override { file_.Close(); }

 protected:
  const Topology& TopologyAt(size_t index) const {
    static const Topology kPoints;
    return index < topologies_.size() ? topologies_[index] : kPoints;
  }

  OutputFile file_;

 private:
  const std::vector<Topology> topologies_;
};

class ObjWriter final : public GeometryWriter {
 public:
  using GeometryWriter::GeometryWriter;

 private:
  void DoAdd(const States& states, const std::optional<SampleTime>&) override {
    file_.Write("# Drape: metres, +Y up\n");
    uint64_t offset = 1;  // indices of the format count from 1 through the whole file
    for (size_t index = 0; index < states.size(); ++index) {
      const ClothState& cloth = states[index];
      std::string text = "o cloth_" + std::to_string(index) + "\n";
      for (size_t particle = 0; particle < cloth.particle_count; ++particle) {
        text += "v ";
        AppendPosition(cloth, particle, &text);
        text += '\n';
      }
      AppendElements(TopologyAt(index), cloth.particle_count, offset, &text);
      file_.Write(text);
      offset += cloth.particle_count;
    }
  }

  static void AppendElements(const Topology& topology, size_t particle_count, uint64_t offset,
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
      AppendIndices(std::array<uint32_t, 1>{particle}, offset, text);
    }
  }
};

class PlyWriter final : public GeometryWriter {
 public:
  using GeometryWriter::GeometryWriter;

 private:
  void DoAdd(const States& states, const std::optional<SampleTime>&) override {
    file_.Write(Header(states));
    for (size_t index = 0; index < states.size(); ++index) {
      std::string text;
      for (size_t particle = 0; particle < states[index].particle_count; ++particle) {
        AppendPosition(states[index], particle, &text);
        text += ' ' + std::to_string(index) + '\n';
      }
      file_.Write(text);
    }
    WriteElements(states, "3", &Topology::triangles);
    WriteElements(states, "", &Topology::lines);
  }

  std::string Header(const States& states) const {
    uint64_t vertex_count = 0;
    uint64_t face_count = 0;
    uint64_t edge_count = 0;
    bool is_float64 = false;
    for (size_t index = 0; index < states.size(); ++index) {
      vertex_count += states[index].particle_count;
      face_count += TopologyAt(index).triangles.size();
      edge_count += TopologyAt(index).lines.size();
      is_float64 = is_float64 || states[index].positions_m.is_float64();
    }
    const std::string type = is_float64 ? "double" : "float";
    std::string text = "ply\nformat ascii 1.0\ncomment Drape: metres, +Y up\n";
    text += "element vertex " + std::to_string(vertex_count) + "\n";
    for (const char* axis : {"x", "y", "z"}) text += "property " + type + " " + axis + "\n";
    text += "property uint cloth\n";
    text += "element face " + std::to_string(face_count) + "\n";
    text += "property list uchar uint vertex_indices\n";
    if (edge_count > 0) {
      text += "element edge " + std::to_string(edge_count) + "\n";
      text += "property uint vertex1\nproperty uint vertex2\n";
    }
    return text + "end_header\n";
  }

  // One line per element of all cloths: `prefix`, then the indices.
  template <class Elements>
  void WriteElements(const States& states, const std::string& prefix,
                     Elements Topology::*elements) {
    uint64_t offset = 0;
    for (size_t index = 0; index < states.size(); ++index) {
      std::string text;
      for (const auto& element : TopologyAt(index).*elements) {
        std::string line;
        AppendIndices(element, offset, &line);
        text += prefix.empty() ? line.substr(1) : prefix + line;
      }
      file_.Write(text);
      offset += states[index].particle_count;
    }
  }
};

}  // namespace

std::unique_ptr<StateWriter> MakeObjWriter(const std::filesystem::path& path,
                                           std::vector<Topology> topologies) {
  return std::make_unique<ObjWriter>(path, std::move(topologies));
}

std::unique_ptr<StateWriter> MakePlyWriter(const std::filesystem::path& path,
                                           std::vector<Topology> topologies) {
  return std::make_unique<PlyWriter>(path, std::move(topologies));
}

bool IsStateFile(const std::filesystem::path& path) {
  const std::string extension = path.extension().string();
  return extension == ".csv" || extension == ".npz" || extension == ".obj" || extension == ".ply";
}

std::unique_ptr<StateWriter> MakeStateWriter(const std::filesystem::path& path,
                                             std::vector<Topology> topologies) {
  const std::string extension = path.extension().string();
  if (extension == ".csv") return MakeCsvWriter(path);
  if (extension == ".npz") return MakeNpzWriter(path);
  if (extension == ".obj") return MakeObjWriter(path, std::move(topologies));
  return MakePlyWriter(path, std::move(topologies));
}

}  // namespace drape::cli
