#include "server/gl/program.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include "server/gl/buffer.h"
#include "server/gl/context.h"
#include "server/gl/sync.h"

namespace drape::gl {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class ProgramTest : public testing::Test {
 protected:
  void SetUp() override {
    Result<std::unique_ptr<Context>> context = Context::Create({});
    ASSERT_TRUE(context.ok()) << context.status().ToString();
    context_ = std::move(context).value();
  }

  static Result<Program> Compile(const ShaderLibrary& library) {
    const Result<ShaderSource> source =
        library.Assemble("kernels/k.comp", "#define LOCAL_SIZE 4\n");
    if (!source.ok()) return source.status();
    return Program::Compile(source.value());
  }

 private:
  std::unique_ptr<Context> context_;
};

constexpr const char* kScaleKernel = R"(
layout(local_size_x = LOCAL_SIZE) in;
layout(std430, binding = 3) buffer Values { uint values[]; };
layout(location = 1) uniform uint factor;
void main() { values[gl_GlobalInvocationID.x] *= factor; }
)";

TEST_F(ProgramTest, RunsOverABuffer) {
  ShaderLibrary library;
  library.Add("kernels/k.comp", kScaleKernel);
  Result<Program> program = Compile(library);
  ASSERT_TRUE(program.ok()) << program.status().ToString();
  Result<Buffer> buffer = Buffer::Create(8 * sizeof(GLuint));
  ASSERT_TRUE(buffer.ok());
  std::array<GLuint, 8> values = {1, 2, 3, 4, 5, 6, 7, 8};
  buffer->Upload(0, std::as_bytes(std::span(values)));
  buffer->BindStorage(3);
  program->Use();
  program->SetUniform(1, 10);
  TimerQuery timer;
  timer.Start();
  glDispatchCompute(1, 1, 1);
  timer.Stop();
  glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
  WaitForDevice();
  EXPECT_GE(timer.ElapsedUs(), 0);
  buffer->Download(0, std::as_writable_bytes(std::span(values)));
  EXPECT_THAT(values, ElementsAre(10, 20, 30, 40, 5, 6, 7, 8)) << "one work group of four";
}

TEST_F(ProgramTest, UniformThatDoesNotExistIsNoError) {
  ShaderLibrary library;
  library.Add("kernels/k.comp", kScaleKernel);
  Result<Program> program = Compile(library);
  ASSERT_TRUE(program.ok());
  program->SetUniform(7, 1);
  EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR));
}

TEST_F(ProgramTest, CompileErrorNamesFileAndLine) {
  ShaderLibrary library;
  library.Add("lib/broken.glsl",
              "float Fine() { return 1.0; }\n\nfloat Broken() { return missing; }\n");
  library.Add(
      "kernels/k.comp",
      "#include \"lib/broken.glsl\"\nlayout(local_size_x = 1) in;\nvoid main() { Broken(); }\n");
  const Result<Program> program = Compile(library);
  ASSERT_FALSE(program.ok());
  EXPECT_EQ(program.status().code(), StatusCode::kInternal);
  EXPECT_EQ(program.status().reason(), "SHADER_COMPILE_FAILED");
  EXPECT_THAT(program.status().message(), HasSubstr("kernels/k.comp"));
  EXPECT_THAT(program.status().message(), HasSubstr("lib/broken.glsl:3"));
  EXPECT_THAT(program.status().message(), HasSubstr("missing"));
}

TEST_F(ProgramTest, LinkErrorIsReported) {
  ShaderLibrary library;
  library.Add("kernels/k.comp", R"(
layout(local_size_x = 1) in;
shared float far_too_much[1 << 26];
layout(std430, binding = 0) buffer Values { float values[]; };
void main() {
  far_too_much[uint(values[0])] = 1.0;
  values[1] = far_too_much[uint(values[2])];
}
)");
  const Result<Program> program = Compile(library);
  ASSERT_FALSE(program.ok());
  EXPECT_EQ(program.status().reason(), "SHADER_COMPILE_FAILED");
}

TEST_F(ProgramTest, BufferCopiesOnTheDevice) {
  Result<Buffer> small = Buffer::Create(16);
  Result<Buffer> large = Buffer::Create(32);
  ASSERT_TRUE(small.ok() && large.ok());
  std::array<GLuint, 4> values = {4, 3, 2, 1};
  small->Upload(0, std::as_bytes(std::span(values)));
  large->CopyFrom(small.value(), 16);
  std::array<GLuint, 2> read = {};
  large->Download(8, std::as_writable_bytes(std::span(read)));
  EXPECT_THAT(read, ElementsAre(2, 1));
}

TEST_F(ProgramTest, BufferBeyondTheDeviceIsRefused) {
  const Result<Buffer> buffer = Buffer::Create(std::numeric_limits<int64_t>::max() / 2);
  ASSERT_FALSE(buffer.ok());
  EXPECT_EQ(buffer.status().code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(buffer.status().reason(), "DEVICE_MEMORY");
}

}  // namespace
}  // namespace drape::gl
