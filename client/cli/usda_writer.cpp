// USD as text (.usda), https://openusd.org: a prim per cloth, with time samples.
#include <array>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/float32.h"
#include "client/cli/output_file.h"
#include "client/cli/state_writers.h"
#include "client/cli/usda_parts.h"

namespace drape::cli {
namespace {

// "(x, y, z)"
void AppendTuple(const float* vector, std::string* text) {
  *text += '(';
  for (size_t axis = 0; axis < 3; ++axis) {
    if (axis > 0) *text += ", ";
    AppendNumber(vector[axis], text);
  }
  *text += ')';
}

// The vectors of `particles`, [particles.size()][3].
std::vector<float> Gather(const VectorView& vectors, const std::vector<uint32_t>& particles) {
  std::vector<float> all;
  AppendFloat32(vectors, &all);
  std::vector<float> gathered;
  gathered.reserve(3 * particles.size());
  for (const uint32_t particle : particles) {
    const auto first = all.begin() + 3 * static_cast<std::ptrdiff_t>(particle);
    gathered.insert(gathered.end(), first, first + 3);
  }
  return gathered;
}

std::string ArrayText(const std::vector<float>& elements) {
  std::string text = "[";
  for (size_t at = 0; at < elements.size(); at += 3) {
    if (at > 0) text += ", ";
    AppendTuple(&elements[at], &text);
  }
  return text + "]";
}

// The box of balls of this radius around some positions.
std::string ExtentText(const std::vector<float>& positions, float radius_m) {
  std::vector<float> box(positions.begin(), positions.begin() + 3);
  box.insert(box.end(), positions.begin(), positions.begin() + 3);
  for (size_t k = 0; k < positions.size(); ++k) {
    box[k % 3] = std::min(box[k % 3], positions[k] - radius_m);
    box[3 + k % 3] = std::max(box[3 + k % 3], positions[k] + radius_m);
  }
  return ArrayText(box);
}

// The format has all samples of an attribute together, but a run produces all attributes of a
// sample together. So values wait here as text, and little is left to do at the end.
class Spool {
 public:
  // The place of a value.
  struct Piece {
    uint64_t offset = 0;
    size_t size = 0;
  };

  explicit Spool(const std::filesystem::path& path) : path_(path), file_(OpenSpool(path)) {}

  Piece Add(const std::string& text) {
    const Piece piece{size_, text.size()};
    if (std::fwrite(text.data(), 1, text.size(), file_.get()) != text.size()) {
      ThrowCannotWrite(path_);
    }
    size_ += text.size();
    return piece;
  }

  std::string Read(const Piece& piece) {
    std::string text(piece.size, '\0');
    if (fseeko(file_.get(), static_cast<off_t>(piece.offset), SEEK_SET) != 0 ||
        std::fread(text.data(), 1, text.size(), file_.get()) != text.size()) {
      ThrowCannotWrite(path_);
    }
    return text;
  }

 private:
  std::filesystem::path path_;
  FilePointer file_;
  uint64_t size_ = 0;
};

// An attribute that changes with time, and its values.
struct SampledAttribute {
  const char* declaration;
  std::vector<Spool::Piece> samples;
};

struct SampledPart {
  UsdaPart part;
  SampledAttribute extent{"float3[] extent", {}};
  SampledAttribute points{"point3f[] points", {}};
  SampledAttribute velocities{"vector3f[] velocities", {}};
};

class UsdaWriter final : public StateWriter {
 public:
  UsdaWriter(const std::filesystem::path& path, StateFileOptions options)
      : options_(std::move(options)), file_(path), spool_(path) {}

  bool takes_samples() const override { return true; }

  void Finish() override {
    file_.Write(Header());
    for (SampledPart& part : parts_) WritePart(part);
    file_.Write("}\n");
    file_.Close();
  }

 private:
  void DoAdd(const States& states, const std::optional<SampleTime>& sample) override {
    if (states.empty()) return;
    if (parts_.empty()) {
      for (UsdaPart& part : UsdaParts(states, options_.topologies)) {
        parts_.push_back({.part = std::move(part)});
      }
    }
    const uint64_t step = sample ? sample->step : states[0].step;
    const double time_s = sample ? sample->time_s : states[0].time_s;
    time_codes_.emplace_back();
    if (options_.time_step_s > 0) {
      AppendNumber(step, &time_codes_.back());
    } else {
      AppendNumber(time_s, kTimeDigits, &time_codes_.back());
    }
    for (SampledPart& sampled : parts_) {
      const ClothState& cloth = states[sampled.part.cloth];
      const std::vector<float> points = Gather(cloth.positions_m, sampled.part.particles);
      sampled.extent.samples.push_back(spool_.Add(ExtentText(points, sampled.part.radius_m)));
      sampled.points.samples.push_back(spool_.Add(ArrayText(points)));
      if (cloth.velocities_m_per_s.empty()) continue;
      sampled.velocities.samples.push_back(
          spool_.Add(ArrayText(Gather(cloth.velocities_m_per_s, sampled.part.particles))));
    }
  }

  std::string Header() const {
    std::string rate = "1";
    if (options_.time_step_s > 0) {
      rate.clear();
      AppendNumber(1 / options_.time_step_s, kTimeDigits, &rate);
    }
    std::string text = "#usda 1.0\n(\n    defaultPrim = \"scene\"\n    doc = \"Drape\"\n";
    if (!time_codes_.empty()) text += "    endTimeCode = " + time_codes_.back() + "\n";
    text += "    framesPerSecond = " + rate + "\n    metersPerUnit = 1\n";
    if (!time_codes_.empty()) text += "    startTimeCode = " + time_codes_.front() + "\n";
    text += "    timeCodesPerSecond = " + rate + "\n    upAxis = \"Y\"\n)\n\n";
    return text + "def Xform \"scene\" (\n    kind = \"component\"\n)\n{\n";
  }

  void WritePart(SampledPart& sampled) {
    const UsdaPart& part = sampled.part;
    if (&sampled != &parts_.front()) file_.Write("\n");
    file_.Write("    def " + std::string(part.type) + " \"" + part.name + "\"\n    {\n");
    file_.Write(part.attributes);
    for (const SampledAttribute* attribute :
         {&sampled.extent, &sampled.points, &sampled.velocities}) {
      if (!attribute->samples.empty()) WriteSamples(*attribute);
    }
    file_.Write("    }\n");
  }

  void WriteSamples(const SampledAttribute& attribute) {
    file_.Write("        " + std::string(attribute.declaration) + ".timeSamples = {\n");
    for (size_t index = 0; index < attribute.samples.size(); ++index) {
      file_.Write("            " + time_codes_[index] + ": ");
      file_.Write(spool_.Read(attribute.samples[index]));
      file_.Write(",\n");
    }
    file_.Write("        }\n");
  }

  static constexpr int kTimeDigits = 15;  // 1 / (1 / 60) is 60

  const StateFileOptions options_;
  OutputFile file_;
  Spool spool_;
  std::vector<SampledPart> parts_;
  std::vector<std::string> time_codes_;
};

}  // namespace

std::unique_ptr<StateWriter> MakeUsdaWriter(const std::filesystem::path& path,
                                            StateFileOptions options) {
  return std::make_unique<UsdaWriter>(path, std::move(options));
}

}  // namespace drape::cli
