#include "client/cli/state_writers.h"

#include <utility>

namespace drape::cli {
namespace {

using Path = std::filesystem::path;
using Writer = std::unique_ptr<StateWriter>;

struct Format {
  const char* extension;
  Writer (*make)(const Path& path, StateFileOptions options);
};

constexpr Format kFormats[] = {
    {".csv", MakeCsvWriter},
    {".npz", MakeNpzWriter},
    {".obj", MakeObjWriter},
    {".pc2", [](const Path& path, StateFileOptions) { return MakePc2Writer(path); }},
    {".ply", MakePlyWriter},
    {".usda", MakeUsdaWriter},
};

const Format* FormatOf(const Path& path) {
  for (const Format& format : kFormats) {
    if (path.extension() == format.extension) return &format;
  }
  return nullptr;
}

}  // namespace

bool IsStateFile(const Path& path) {
  return FormatOf(path) != nullptr;
}

std::string StateFileExtensions() {
  std::string text;
  for (const Format& format : kFormats) {
    const bool is_last = &format == std::end(kFormats) - 1;
    if (!text.empty()) text += is_last ? " or " : ", ";
    text += format.extension;
  }
  return text;
}

Writer MakeStateWriter(const Path& path, StateFileOptions options) {
  const Format* format = FormatOf(path);
  // Commands check it first: a bug here, but no reason to crash.
  if (format == nullptr) throw std::invalid_argument(path.string() + ": not a state file");
  return format->make(path, std::move(options));
}

}  // namespace drape::cli
