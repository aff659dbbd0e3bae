// PC2, the point cache of 3ds Max, which Blender reads with its Mesh Cache modifier.
#include <bit>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/float32.h"
#include "client/cli/output_file.h"
#include "client/cli/state_writers.h"

namespace drape::cli {
namespace {

static_assert(std::endian::native == std::endian::little, "writes the byte order of the format");

// The header of the file.
struct Header {
  char magic[12] = {'P', 'O', 'I', 'N', 'T', 'C', 'A', 'C', 'H', 'E', '2', '\0'};
  int32_t version = 1;
  int32_t point_count = 0;
  float start = 0;     // of the first sample [steps]
  float sampling = 1;  // from one sample to the next [steps]
  int32_t sample_count = 0;
};
static_assert(sizeof(Header) == 32, "no padding");

std::string_view Bytes(const Header& header) {
  return {reinterpret_cast<const char*>(&header), sizeof(header)};
}

class Pc2Writer final : public StateWriter {
 public:
  explicit Pc2Writer(const std::filesystem::path& path) : file_(path) { PutHeader(); }

  bool takes_samples() const override { return true; }

  // The number of samples is known only now.
  void Finish() override {
    PutHeader();
    file_.Close();
  }

 private:
  void DoAdd(const States& states, const std::optional<SampleTime>& sample) override {
    if (states.empty()) return;
    const uint64_t step = sample ? sample->step : states[0].step;
    std::vector<float> elements;
    for (const ClothState& cloth : states) AppendFloat32(cloth.positions_m, &elements);
    file_.Write({reinterpret_cast<const char*>(elements.data()), elements.size() * sizeof(float)});

    if (header_.sample_count == 0) {
      header_.point_count = static_cast<int32_t>(elements.size() / 3);
      header_.start = static_cast<float>(step);
      first_step_ = step;
    } else if (header_.sample_count == 1) {
      header_.sampling = static_cast<float>(step - first_step_);
    }
    ++header_.sample_count;
  }

  void PutHeader() { file_.WriteAtStart(Bytes(header_)); }

  OutputFile file_;
  Header header_;
  uint64_t first_step_ = 0;
};

}  // namespace

std::unique_ptr<StateWriter> MakePc2Writer(const std::filesystem::path& path) {
  return std::make_unique<Pc2Writer>(path);
}

}  // namespace drape::cli
