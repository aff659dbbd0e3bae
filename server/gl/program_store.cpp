#include "server/gl/program_store.h"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string_view>
#include <system_error>
#include <utility>

namespace drape::gl {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kMagic = "drape program 1\n";
constexpr const char* kExtension = ".program";

// FNV-1a (RFC draft-eastlake-fnv). It names files and finds damage; texts are compared in full.
uint64_t Hash(std::string_view bytes) {
  uint64_t hash = 0xcbf29ce484222325u;
  for (const char byte : bytes) hash = (hash ^ static_cast<unsigned char>(byte)) * 0x100000001b3u;
  return hash;
}

std::string Driver() {
  std::string driver;
  for (const GLenum name : {GL_VENDOR, GL_RENDERER, GL_VERSION, GL_SHADING_LANGUAGE_VERSION}) {
    const GLubyte* text = glGetString(name);
    if (text != nullptr) driver += reinterpret_cast<const char*>(text);
    driver += '\n';
  }
  return driver;
}

void WarnOnce(const fs::path& folder, const std::string& why) {
  static std::atomic<bool> has_warned = false;
  if (has_warned.exchange(true)) return;
  spdlog::warn("program_cache_failed folder={} reason=\"{}\"", folder.string(), why);
}

template <class T>
void Put(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

// Of what Put has written: an empty answer beyond the end.
class Cursor {
 public:
  explicit Cursor(std::string_view bytes) : bytes_(bytes) {}

  std::string_view Take(uint64_t count) {
    if (count > bytes_.size()) {
      bytes_ = {};
      return {};
    }
    const std::string_view taken = bytes_.substr(0, count);
    bytes_.remove_prefix(count);
    return taken;
  }
  template <class T>
  T Number() {
    T value{};
    const std::string_view taken = Take(sizeof(value));
    std::copy(taken.begin(), taken.end(), reinterpret_cast<char*>(&value));
    return value;
  }
  std::string_view Text() { return Take(Number<uint64_t>()); }

 private:
  std::string_view bytes_;
};

void DeleteOldest(const fs::path& folder, uint64_t max_bytes) {
  struct File {
    fs::file_time_type used;
    uint64_t bytes;
    fs::path path;
  };
  std::vector<File> files;
  uint64_t sum = 0;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    if (entry.path().extension() != kExtension) continue;
    File file{{}, entry.file_size(error), entry.path()};
    if (!error) file.used = entry.last_write_time(error);
    if (error) continue;  // another process has just deleted it
    files.push_back(file);
    sum += file.bytes;
  }
  std::ranges::sort(files, {}, &File::used);
  for (const File& file : files) {
    if (sum <= max_bytes) return;
    fs::remove(file.path, error);
    sum -= file.bytes;
  }
}

}  // namespace

std::unique_ptr<ProgramStore> ProgramStore::Open(const fs::path& folder, uint64_t max_bytes) {
  if (folder.empty()) return nullptr;
  GLint formats = 0;
  glGetIntegerv(GL_NUM_PROGRAM_BINARY_FORMATS, &formats);
  if (formats == 0) {
    WarnOnce(folder, "the driver has no binaries of programs");
    return nullptr;
  }
  std::error_code error;
  if (fs::create_directories(folder, error)) {
    fs::permissions(folder, fs::perms::owner_all, error);
  }
  if (!fs::is_directory(folder, error)) {
    WarnOnce(folder, error ? error.message() : "it is no folder");
    return nullptr;
  }
  DeleteOldest(folder, max_bytes);
  return std::unique_ptr<ProgramStore>(new ProgramStore(folder, Driver()));
}

fs::path ProgramStore::PathOf(const std::string& text) const {
  std::ostringstream name;
  name << std::hex << Hash(driver_ + text) << kExtension;
  return folder_ / name.str();
}

std::optional<ProgramBinary> ProgramStore::Find(const std::string& text) const {
  const fs::path path = PathOf(text);
  std::ifstream file(path, std::ios::binary);
  if (!file) return std::nullopt;
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  constexpr size_t kSum = sizeof(uint64_t);
  if (bytes.size() < kSum) return std::nullopt;
  const std::string_view content(bytes.data(), bytes.size() - kSum);
  if (Cursor(std::string_view(bytes).substr(content.size())).Number<uint64_t>() != Hash(content)) {
    return std::nullopt;
  }
  Cursor cursor(content);
  if (cursor.Take(kMagic.size()) != kMagic) return std::nullopt;
  if (cursor.Text() != driver_ || cursor.Text() != text) return std::nullopt;
  ProgramBinary binary{cursor.Number<GLenum>(), {}};
  const std::string_view code = cursor.Text();
  binary.bytes.assign(code.begin(), code.end());
  std::error_code error;  // a folder that cannot be written is used all the same
  fs::last_write_time(path, fs::file_time_type::clock::now(), error);
  return binary;
}

void ProgramStore::Keep(const std::string& text, const ProgramBinary& binary) const {
  std::string bytes(kMagic);
  for (const std::string* part : {&driver_, &text}) {
    Put(bytes, uint64_t{part->size()});
    bytes += *part;
  }
  Put(bytes, binary.format);
  Put(bytes, uint64_t{binary.bytes.size()});
  bytes.append(binary.bytes.begin(), binary.bytes.end());
  Put(bytes, Hash(bytes));
  static std::atomic<uint32_t> number = 0;
  const fs::path path = PathOf(text);
  fs::path draft = path;  // what a crash leaves goes in time as the programs do
  draft.replace_extension("." + std::to_string(getpid()) + "." + std::to_string(++number) +
                          kExtension);
  std::ofstream file(draft, std::ios::binary);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  file.close();
  std::error_code error;
  if (file) fs::rename(draft, path, error);
  if (!file || error) {
    WarnOnce(folder_, error ? error.message() : "it cannot be written");
    fs::remove(draft, error);
  }
}

}  // namespace drape::gl
