#include "client/cli/geometry_writer.h"

#include <utility>

#include "client/cli/series_path.h"

namespace drape::cli {
namespace {

template <class Number>
void AppendElements(std::span<const Number> elements, size_t row, std::string* text) {
  for (size_t axis = 0; axis < 3; ++axis) {
    if (axis > 0) *text += ' ';
    AppendNumber(elements[3 * row + axis], text);
  }
}

// One file.
class LastStateWriter final : public StateWriter {
 public:
  LastStateWriter(const std::filesystem::path& path, StateFileOptions options, WriteGeometry write)
      : file_(path), topologies_(std::move(options.topologies)), write_(write) {}

  bool takes_samples() const override { return false; }
  void Finish() override { file_.Close(); }

 private:
  void DoAdd(const States& states, const std::optional<SampleTime>&) override {
    write_(states, topologies_, file_);
  }

  OutputFile file_;
  const std::vector<Topology> topologies_;
  const WriteGeometry write_;
};

// A file per sample. Each appears as soon as it is complete.
class SeriesWriter final : public StateWriter {
 public:
  SeriesWriter(const std::filesystem::path& path, StateFileOptions options, WriteGeometry write)
      : path_(path), topologies_(std::move(options.topologies)), write_(write) {
    const OutputFile trial(path);  // fails before the run if the file cannot be written there
  }

  bool takes_samples() const override { return true; }
  void Finish() override {}

 private:
  void DoAdd(const States& states, const std::optional<SampleTime>& sample) override {
    const uint64_t own_step = states.empty() ? 0 : states[0].step;
    OutputFile file(SeriesPath(path_, sample ? sample->step : own_step));
    write_(states, topologies_, file);
    file.Close();
  }

  const std::filesystem::path path_;
  const std::vector<Topology> topologies_;
  const WriteGeometry write_;
};

}  // namespace

const Topology& TopologyAt(const std::vector<Topology>& topologies, size_t cloth) {
  static const Topology kPoints;
  return cloth < topologies.size() ? topologies[cloth] : kPoints;
}

void AppendVector(const VectorView& vectors, size_t row, std::string* text) {
  if (vectors.is_float64()) {
    AppendElements(vectors.doubles(), row, text);
  } else {
    AppendElements(vectors.floats(), row, text);
  }
}

void AppendIndices(std::span<const uint32_t> indices, uint64_t offset, std::string* text) {
  for (const uint32_t index : indices) {
    *text += ' ';
    AppendNumber(offset + index, text);
  }
  *text += '\n';
}

std::unique_ptr<StateWriter> MakeGeometryWriter(const std::filesystem::path& path,
                                                StateFileOptions options, WriteGeometry write) {
  if (options.is_series) return std::make_unique<SeriesWriter>(path, std::move(options), write);
  return std::make_unique<LastStateWriter>(path, std::move(options), write);
}

}  // namespace drape::cli
