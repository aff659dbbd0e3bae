#include "server/gl/context.h"

#include <epoxy/gl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace drape::gl {
namespace {

using testing::AllOf;
using testing::HasSubstr;

TEST(ContextTest, GivesAnOpenGl45ContextWithItsLimits) {
  const Result<std::unique_ptr<Context>> context = Context::Create({});
  ASSERT_TRUE(context.ok()) << context.status().ToString();
  GLint major = 0;
  GLint minor = 0;
  glGetIntegerv(GL_MAJOR_VERSION, &major);
  glGetIntegerv(GL_MINOR_VERSION, &minor);
  EXPECT_GE(10 * major + minor, 45);
  const Context& made = *context.value();
  EXPECT_FALSE(made.renderer().empty());
  EXPECT_EQ(made.ResetReason(), "");
  // Guarantees of OpenGL 4.5.
  EXPECT_GE(made.limits().storage_block_bytes, 1 << 24);
  EXPECT_GE(made.limits().shared_memory_bytes, 32 * 1024);
  EXPECT_GE(made.limits().work_group_invocations, 1024u);
  EXPECT_GE(made.limits().work_group_count_x, 65535u);
  EXPECT_GE(made.limits().work_group_count_y, 65535u);
  EXPECT_GE(made.limits().storage_blocks, 8u);
}

TEST(ContextTest, HardwareComesFirst) {
  bool has_seen_software = false;
  for (const EglDevice& device : ListEglDevices()) {
    EXPECT_FALSE(has_seen_software && !device.is_software);
    has_seen_software = has_seen_software || device.is_software;
  }
}

TEST(ContextTest, NoDeviceIsAClearError) {
  const Result<std::unique_ptr<Context>> context =
      Context::Create({.device_filter = [](const EglDevice&) { return false; }});
  ASSERT_FALSE(context.ok());
  EXPECT_EQ(context.status().code(), StatusCode::kUnavailable);
  EXPECT_EQ(context.status().reason(), "NO_EGL_DEVICE");
  EXPECT_THAT(context.status().message(),
              AllOf(HasSubstr("no EGL device"), HasSubstr("libgl1-mesa-dri")));
}

TEST(ContextTest, SoftwareIsRefusedWhereOnlyHardwareWillDo) {
  const auto only_software = [](const EglDevice& device) { return device.is_software; };
  const Result<std::unique_ptr<Context>> context =
      Context::Create({.accept_software = false, .device_filter = only_software});
  ASSERT_FALSE(context.ok());
  EXPECT_EQ(context.status().reason(), "NO_EGL_DEVICE");
}

TEST(ContextTest, FindHardwareGlAgreesWithWhatCreateGives) {
  const std::optional<std::string> hardware = FindHardwareGl();
  const Result<std::unique_ptr<Context>> context = Context::Create({});
  ASSERT_TRUE(context.ok()) << context.status().ToString();
  EXPECT_EQ(hardware.has_value(), !context.value()->is_software());
  if (hardware) {
    EXPECT_EQ(*hardware, context.value()->renderer());
  }
}

TEST(ContextTest, TwoContextsTakeTurnsOnOneThread) {
  const Result<std::unique_ptr<Context>> first = Context::Create({});
  ASSERT_TRUE(first.ok());
  {
    const Result<std::unique_ptr<Context>> second = Context::Create({});
    ASSERT_TRUE(second.ok());
    first.value()->MakeCurrent();
    second.value()->MakeCurrent();
  }
  first.value()->MakeCurrent();
  GLuint buffer = 0;
  glCreateBuffers(1, &buffer);
  EXPECT_NE(buffer, 0u);
  EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR));
  glDeleteBuffers(1, &buffer);
}

}  // namespace
}  // namespace drape::gl
