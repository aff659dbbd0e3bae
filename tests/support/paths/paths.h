// The places of the source tree and the programs.
#pragma once

#include <filesystem>
#include <string>

namespace drape::test {

// DRAPE_TEST_ROOT, if set, stands for both: a folder with the files that are read at run time in
// their places and the programs in bin/. For tests that were carried to another machine.
std::filesystem::path SourcePath(const std::string& relative);
std::filesystem::path ProgramPath(const std::string& name);

// What only tests beside the build read, and the command that compiles C++ there, with its cache.
std::filesystem::path BuildPath(const std::string& relative);
std::string CompilerCommand();

}  // namespace drape::test
