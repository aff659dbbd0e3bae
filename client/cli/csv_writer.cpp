#include <limits>
#include <string>
#include <utility>

#include "client/cli/output_file.h"
#include "client/cli/state_writers.h"

namespace drape::cli {
namespace {

constexpr char kHeader[] = "time_s,cloth,particle,x_m,y_m,z_m,vx_m_per_s,vy_m_per_s,vz_m_per_s\n";

template <class Number>
void AppendRow(std::span<const Number> elements, size_t row, std::string* text) {
  for (size_t axis = 0; axis < 3; ++axis) {
    *text += ',';
    AppendNumber(elements[3 * row + axis], text);
  }
}

class CsvWriter final : public StateWriter {
 public:
  CsvWriter(const std::filesystem::path& path, StateFileOptions options)
      : options_(std::move(options)), file_(path) {
    file_.Write(kHeader);
  }

  bool takes_samples() const override { return true; }

  void Finish() override { file_.Close(); }

 private:
  void DoAdd(const States& states, const std::optional<SampleTime>& sample) override {
    for (size_t index = 0; index < states.size(); ++index) {
      const ClothState& cloth = states[index];
      const double time_s = sample ? sample->time_s : cloth.time_s;
      if (cloth.positions_m.is_float64()) {
        AddCloth(index, cloth, time_s, cloth.positions_m.doubles(),
                 cloth.velocities_m_per_s.doubles());
      } else {
        AddCloth(index, cloth, time_s, cloth.positions_m.floats(),
                 cloth.velocities_m_per_s.floats());
      }
    }
  }

  template <class Number>
  void AddCloth(size_t index, const ClothState& cloth, double time_s,
                std::span<const Number> positions, std::span<const Number> velocities) {
    std::string time;
    AppendNumber(time_s, std::numeric_limits<Number>::max_digits10, &time);
    text_.clear();
    for (size_t row = 0; row < cloth.particle_count; ++row) {
      text_ += time;
      text_ += ',';
      AppendNumber(uint64_t{index}, &text_);
      text_ += ',';
      AppendNumber(uint64_t{options_.ParticleOf(row)}, &text_);
      AppendRow(positions, row, &text_);
      AppendRow(velocities, row, &text_);
      text_ += '\n';
    }
    file_.Write(text_);
  }

  const StateFileOptions options_;
  OutputFile file_;
  std::string text_;
};

}  // namespace

std::unique_ptr<StateWriter> MakeCsvWriter(const std::filesystem::path& path,
                                           StateFileOptions options) {
  return std::make_unique<CsvWriter>(path, std::move(options));
}

}  // namespace drape::cli
