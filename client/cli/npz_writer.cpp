#include <zip.h>

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/output_file.h"
#include "client/cli/state_writers.h"
#include "drape/error.h"

namespace drape::cli {
namespace {

// Space for the header of a column, whose length is known only at the end; a multiple of 64, as the
// format requires.
constexpr size_t kHeaderBytes = 128;

// The NPY version 1.0 header of an array (numpy.lib.format), padded to kHeaderBytes.
std::string NpyHeader(const std::string& type, const std::vector<uint64_t>& shape) {
  std::string text = "{'descr': '" + type + "', 'fortran_order': False, 'shape': (";
  for (const uint64_t extent : shape) text += std::to_string(extent) + ",";
  text += "), }";
  const std::string magic = std::string("\x93NUMPY\x01\x00", 8);
  const size_t text_bytes = kHeaderBytes - magic.size() - 2;
  text.resize(text_bytes - 1, ' ');
  const char length[] = {static_cast<char>(text_bytes & 0xFF), static_cast<char>(text_bytes >> 8)};
  return magic + std::string(length, 2) + text + "\n";
}

// One array being written: elements in an unnamed temporary file, the header in front at the end.
class Column {
 public:
  // `path`: of the archive.
  Column(const std::filesystem::path& path, std::string name)
      : path_(path), name_(std::move(name)), file_(OpenSpool(path)) {
    Append(std::string(kHeaderBytes, ' ').data(), kHeaderBytes);
  }

  void Append(const void* bytes, size_t size) {
    if (size > 0 && std::fwrite(bytes, 1, size, file_.get()) != size) ThrowCannotWrite(path_);
  }
  template <class Number>
  void Append(std::span<const Number> elements) {
    Append(elements.data(), elements.size_bytes());
  }
  void Append(const VectorView& vectors) {
    vectors.is_float64() ? Append(vectors.doubles()) : Append(vectors.floats());
  }

  void AddTo(zip_t* archive, const std::string& type, const std::vector<uint64_t>& shape) {
    std::rewind(file_.get());
    const std::string header = NpyHeader(type, shape);
    Append(header.data(), header.size());
    if (std::fflush(file_.get()) != 0) ThrowCannotWrite(path_);
    std::rewind(file_.get());  // the source reads from the current position of the file
    zip_source_t* source = zip_source_filep(archive, file_.get(), 0, -1);
    if (source == nullptr) ThrowCannotWrite(path_);
    file_.release();  // the source closes it
    const zip_int64_t index =
        zip_file_add(archive, (name_ + ".npy").c_str(), source, ZIP_FL_ENC_UTF_8);
    if (index < 0) {
      zip_source_free(source);
      ThrowCannotWrite(path_);
    }
    zip_set_file_compression(archive, static_cast<zip_uint64_t>(index), ZIP_CM_STORE, 0);
  }

 private:
  std::filesystem::path path_;
  std::string name_;
  FilePointer file_;
};

class NpzWriter final : public StateWriter {
 public:
  NpzWriter(const std::filesystem::path& path, StateFileOptions options)
      : path_(path), options_(std::move(options)) {
    int error = 0;
    archive_ = zip_open(path.c_str(), ZIP_CREATE | ZIP_TRUNCATE, &error);
    // The archive appears only when it is closed; check now that it can be written.
    if (archive_ == nullptr) ThrowCannotWrite(path);
    const OutputFile trial(path);
  }
  ~NpzWriter() override {
    if (archive_ != nullptr) zip_discard(archive_);
  }

  bool takes_samples() const override { return true; }

  void Finish() override {
    const std::string type = is_float64_ ? "<f8" : "<f4";
    times_.AddTo(archive_, "<f8", {sample_count_});
    steps_.AddTo(archive_, "<u8", {sample_count_});
    positions_.AddTo(archive_, type, {sample_count_, particle_count_, 3});
    velocities_.AddTo(archive_, type, {sample_count_, particle_count_, 3});
    cloth_.AddTo(archive_, "<u4", {particle_count_});
    particle_.AddTo(archive_, "<u4", {particle_count_});
    if (zip_close(archive_) != 0) ThrowCannotWrite(path_);
    archive_ = nullptr;
  }

 private:
  void DoAdd(const States& states, const std::optional<SampleTime>& sample) override {
    if (states.empty()) return;
    if (sample_count_ == 0) AddIndices(states);
    const double time_s = sample ? sample->time_s : states[0].time_s;
    const uint64_t step = sample ? sample->step : states[0].step;
    times_.Append(&time_s, sizeof(time_s));
    steps_.Append(&step, sizeof(step));
    for (const ClothState& cloth : states) {
      positions_.Append(cloth.positions_m);
      velocities_.Append(cloth.velocities_m_per_s);
    }
    ++sample_count_;
  }

  void AddIndices(const States& states) {
    is_float64_ = states[0].positions_m.is_float64();
    for (uint32_t index = 0; index < states.size(); ++index) {
      for (size_t row = 0; row < states[index].particle_count; ++row) {
        const uint32_t particle = options_.ParticleOf(row);
        cloth_.Append(&index, sizeof(index));
        particle_.Append(&particle, sizeof(particle));
      }
      particle_count_ += states[index].particle_count;
    }
  }

  std::filesystem::path path_;
  const StateFileOptions options_;
  zip_t* archive_ = nullptr;
  bool is_float64_ = false;
  uint64_t sample_count_ = 0;
  uint64_t particle_count_ = 0;
  Column times_{path_, "times"};
  Column steps_{path_, "steps"};
  Column positions_{path_, "positions"};
  Column velocities_{path_, "velocities"};
  Column cloth_{path_, "cloth"};
  Column particle_{path_, "particle"};
};

}  // namespace

std::unique_ptr<StateWriter> MakeNpzWriter(const std::filesystem::path& path,
                                           StateFileOptions options) {
  return std::make_unique<NpzWriter>(path, std::move(options));
}

}  // namespace drape::cli
