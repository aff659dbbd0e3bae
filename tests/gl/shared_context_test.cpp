// Contexts of a share group see each other's work.
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <memory>
#include <thread>
#include <vector>

#include "server/gl/context.h"
#include "server/gl/device_copy.h"
#include "server/gl/program.h"

namespace drape::gl {
namespace {

std::unique_ptr<Context> MakeContext(const ContextOptions& options = {}) {
  Result<std::unique_ptr<Context>> context = Context::Create(options);
  DRAPE_CHECK(context.ok(), context.status().ToString());
  return std::move(context).value();
}

Program CompileFill() {
  ShaderLibrary library;
  library.Add("kernels/fill.comp", R"(
layout(local_size_x = 64) in;
layout(std430, binding = 0) buffer Values { uint values[]; };
layout(location = 0) uniform uint seed;
void main() {
  uint value = seed + gl_GlobalInvocationID.x;
  for (int k = 0; k < 200; ++k) value = value * 1664525u + 1013904223u;
  values[gl_GlobalInvocationID.x] = value;
}
)");
  const Result<ShaderSource> source = library.Assemble("kernels/fill.comp", "");
  DRAPE_CHECK(source.ok(), source.status().ToString());
  Result<Program> program = Program::Compile(source.value());
  DRAPE_CHECK(program.ok(), program.status().ToString());
  return std::move(program).value();
}

constexpr size_t kCount = 64 * 512;

std::vector<GLuint> Expected(GLuint seed) {
  std::vector<GLuint> values(kCount);
  for (size_t i = 0; i < kCount; ++i) {
    auto value = static_cast<GLuint>(seed + i);
    for (int k = 0; k < 200; ++k) value = value * 1664525u + 1013904223u;
    values[i] = value;
  }
  return values;
}

// One context computes and copies, again and again over the same buffer; another one, on its own
// thread, reads the copies as their fences allow.
TEST(SharedContextTest, CopiesArriveCompleteOnAnotherThread) {
  const std::unique_ptr<Context> context = MakeContext();
  const Program fill = CompileFill();
  Result<Buffer> values = Buffer::Create(kCount * sizeof(GLuint));
  ASSERT_TRUE(values.ok());
  std::vector<std::shared_ptr<DeviceCopy>> copies;
  for (GLuint seed = 0; seed < 8; ++seed) {
    values->BindStorage(0);
    fill.Use();
    fill.SetUniform(0, seed);
    glDispatchCompute(kCount / 64, 1, 1);
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    Result<Buffer> copy = Buffer::Create(kCount * sizeof(GLuint));
    ASSERT_TRUE(copy.ok());
    copy->CopyFrom(values.value(), kCount * sizeof(GLuint));
    copies.push_back(
        std::make_shared<DeviceCopy>(DeviceCopy{std::move(copy).value(), Fence::Insert()}));
  }
  std::thread reader([&, handle = context->share_handle()] {
    const std::unique_ptr<Context> other = MakeContext({.share_with = handle});
    EXPECT_EQ(other->renderer(), context->renderer());
    for (GLuint seed = 0; seed < copies.size(); ++seed) {
      copies[seed]->ready.WaitOnDevice();
      std::vector<GLuint> read(kCount);
      copies[seed]->buffer.Download(0, std::as_writable_bytes(std::span(read)));
      EXPECT_EQ(read, Expected(seed)) << seed;
      copies[seed].reset();
    }
    EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR));
  });
  reader.join();
}

// Objects live until the last context of the group is destroyed.
TEST(SharedContextTest, OutlivesTheContextItWasMadeWith) {
  std::unique_ptr<Context> first = MakeContext();
  Result<Buffer> buffer = Buffer::Create(4);
  ASSERT_TRUE(buffer.ok());
  const GLuint value = 7;
  buffer->Upload(0, std::as_bytes(std::span(&value, 1)));
  const std::unique_ptr<Context> second = MakeContext({.share_with = first->share_handle()});
  first.reset();
  second->MakeCurrent();
  GLuint read = 0;
  buffer->Download(0, std::as_writable_bytes(std::span(&read, 1)));
  EXPECT_EQ(read, value);
}

TEST(SharedContextTest, ContextsApartShareNothing) {
  const std::unique_ptr<Context> first = MakeContext();
  Result<Buffer> buffer = Buffer::Create(4);
  ASSERT_TRUE(buffer.ok());
  const std::unique_ptr<Context> second = MakeContext();
  EXPECT_EQ(glIsBuffer(buffer->name()), static_cast<GLboolean>(GL_FALSE));
  first->MakeCurrent();
  EXPECT_EQ(glIsBuffer(buffer->name()), static_cast<GLboolean>(GL_TRUE));
}

TEST(SharedContextTest, WhatIsNoContextCannotBeShared) {
  const std::unique_ptr<Context> context = MakeContext();
  int not_a_context = 0;
  const Result<std::unique_ptr<Context>> shared =
      Context::Create({.share_with = ShareHandle{context->share_handle().display, &not_a_context}});
  ASSERT_FALSE(shared.ok());
  EXPECT_EQ(shared.status().code(), StatusCode::kUnavailable);
  EXPECT_NE(shared.status().message().find("not shared"), std::string::npos);
}

TEST(FenceTest, AnEmptyFenceIsNoWait) {
  const std::unique_ptr<Context> context = MakeContext();
  const Fence fence;
  fence.WaitOnDevice();
  EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR));
}

}  // namespace
}  // namespace drape::gl
