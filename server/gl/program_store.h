// Compiled programs on disk, for the next start.
#pragma once

#include <epoxy/gl.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace drape::gl {

// What glGetProgramBinary gives.
struct ProgramBinary {
  GLenum format = 0;
  std::vector<char> bytes;
};

// A folder with a file per program. Each file holds the driver and the whole text that it was made
// from, which are compared, and a checksum: another driver, another text or a damaged file is as if
// there were none. Files replace each other whole, so several processes may share a folder. Nothing
// here fails: what cannot be read or written costs a compilation, and a warning in the log once.
// Thread-safe. The folder should be the user's own: a driver trusts what it loads.
class ProgramStore {
 public:
  // The folder is made if need be. If its files exceed `max_bytes`, the ones not used for longest
  // are deleted. Null without a folder, and where the driver has no binaries. Needs a current
  // context.
  static std::unique_ptr<ProgramStore> Open(const std::filesystem::path& folder,
                                            uint64_t max_bytes = kMaxBytes);

  std::optional<ProgramBinary> Find(const std::string& text) const;
  void Keep(const std::string& text, const ProgramBinary& binary) const;

  // Of kernels of some hundred KiB.
  static constexpr uint64_t kMaxBytes = uint64_t{256} << 20;

 private:
  ProgramStore(std::filesystem::path folder, std::string driver)
      : folder_(std::move(folder)), driver_(std::move(driver)) {}
  std::filesystem::path PathOf(const std::string& text) const;

  const std::filesystem::path folder_;
  const std::string driver_;
};

}  // namespace drape::gl
