#include "client/cli/series_path.h"

#include <algorithm>
#include <string>

namespace drape::cli {

std::filesystem::path SeriesPath(const std::filesystem::path& path, uint64_t step) {
  constexpr size_t kLeastDigits = 6;
  const std::string number = std::to_string(step);
  const std::string padding(kLeastDigits - std::min(kLeastDigits, number.size()), '0');
  std::filesystem::path name = path.stem();
  name += "_" + padding + number;
  name += path.extension();
  return path.parent_path() / name;
}

}  // namespace drape::cli
