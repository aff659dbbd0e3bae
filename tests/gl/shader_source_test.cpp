#include "server/gl/shader_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace drape::gl {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

TEST(ShaderSourceTest, IncludesEachFileOnceAndKeepsLineNumbers) {
  ShaderLibrary library;
  library.Add("lib/a.glsl", "float a;\n");
  library.Add("interface/b.h", "#include <cstdint>\n#include \"shaders/lib/a.glsl\"\nfloat b;\n");
  library.Add("kernels/k.comp",
              "#include \"lib/a.glsl\"\n  #include \"interface/b.h\"\nvoid main() {}\n");
  const Result<ShaderSource> source = library.Assemble("kernels/k.comp", "#define X 1\n");
  ASSERT_TRUE(source.ok()) << source.status().ToString();
  EXPECT_EQ(source->name, "kernels/k.comp");
  EXPECT_EQ(source->text,
            "#version 450 core\n"
            "#define X 1\n"
            "float a;\n"
            "float b;\n"
            "void main() {}\n");
  std::vector<std::string> places;
  for (const SourceLine& line : source->lines) {
    places.push_back(line.file + ":" + std::to_string(line.line));
  }
  EXPECT_THAT(places, ElementsAre("<version>:1", "<defines>:1", "lib/a.glsl:1", "interface/b.h:3",
                                  "kernels/k.comp:3"));
}

TEST(ShaderSourceTest, MissingIncludeNamesFileAndLine) {
  ShaderLibrary library;
  library.Add("kernels/k.comp", "float x;\n#include \"lib/none.glsl\"\n");
  const Result<ShaderSource> source = library.Assemble("kernels/k.comp", "");
  ASSERT_FALSE(source.ok());
  EXPECT_EQ(source.status().reason(), "SHADER_COMPILE_FAILED");
  EXPECT_THAT(source.status().message(), HasSubstr("kernels/k.comp:2"));
  EXPECT_THAT(source.status().message(), HasSubstr("lib/none.glsl"));
}

TEST(ShaderSourceTest, MissingKernelIsAnError) {
  const Result<ShaderSource> source = ShaderLibrary().Assemble("kernels/none.comp", "");
  ASSERT_FALSE(source.ok());
  EXPECT_EQ(source.status().reason(), "SHADER_COMPILE_FAILED");
}

TEST(ShaderSourceTest, LogsOfMesaAndNvidiaGetFileNames) {
  const std::vector<SourceLine> lines = {
      {"<version>", 1}, {"kernels/k.comp", 12}, {"lib/a.glsl", 7}};
  EXPECT_EQ(WithFileNames("0:2(5): error: x undeclared\n0:3(1): warning: y", lines),
            "kernels/k.comp:12: error: x undeclared\nlib/a.glsl:7: warning: y");
  EXPECT_EQ(WithFileNames("0(3) : error C1503: undefined variable \"z\"\n0(2) : warning", lines),
            "lib/a.glsl:7 : error C1503: undefined variable \"z\"\nkernels/k.comp:12 : warning");
  EXPECT_EQ(WithFileNames("0:9(5): error", lines), "0:9(5): error") << "no such line";
}

TEST(ShaderSourceTest, DirectoryReplacesFiles) {
  const std::filesystem::path directory =
      std::filesystem::path(testing::TempDir()) / "drape_shader_source_test";
  std::filesystem::create_directories(directory / "kernels");
  std::ofstream(directory / "kernels" / "k.comp") << "void main() { /* new */ }\n";
  ShaderLibrary library;
  library.Add("kernels/k.comp", "void main() { /* old */ }\n");
  const Status status = library.AddDirectory(directory.string());
  ASSERT_TRUE(status.ok()) << status.ToString();
  const Result<ShaderSource> source = library.Assemble("kernels/k.comp", "");
  ASSERT_TRUE(source.ok());
  EXPECT_THAT(source->text, HasSubstr("new"));
  std::filesystem::remove_all(directory);
}

TEST(ShaderSourceTest, ADirectoryThatReplacesNothingIsAnError) {
  const std::filesystem::path directory =
      std::filesystem::path(testing::TempDir()) / "drape_shader_source_test_unused";
  std::filesystem::create_directories(directory);
  ShaderLibrary library;
  library.Add("kernels/k.comp", "void main() {}\n");
  EXPECT_EQ(library.AddDirectory(directory.string()).reason(), "SHADER_DIR_UNUSED");
  std::ofstream(directory / "k.comp") << "void main() {}\n";  // not below kernels/
  const Status status = library.AddDirectory(directory.string());
  EXPECT_EQ(status.reason(), "SHADER_DIR_UNUSED");
  EXPECT_THAT(status.message(), HasSubstr("kernels/k.comp"));
  std::filesystem::remove_all(directory);
}

TEST(ShaderSourceTest, UnreadableDirectoryIsNotFound) {
  const Status status = ShaderLibrary().AddDirectory("/no/such/directory");
  EXPECT_EQ(status.code(), StatusCode::kNotFound);
  EXPECT_EQ(status.reason(), "SHADER_DIR_NOT_FOUND");
  EXPECT_THAT(status.message(), HasSubstr("/no/such/directory"));
}

}  // namespace
}  // namespace drape::gl
