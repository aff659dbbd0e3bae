// Names of the files of a series: one file per sample.
#pragma once

#include <cstdint>
#include <filesystem>

namespace drape::cli {

// The file of the sample after `step` steps, beside `path`: "out/s.obj" and 60 give
// "out/s_000060.obj". At least six digits, so that a folder lists the files in order.
std::filesystem::path SeriesPath(const std::filesystem::path& path, uint64_t step);

}  // namespace drape::cli
