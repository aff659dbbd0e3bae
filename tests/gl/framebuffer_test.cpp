#include "server/gl/framebuffer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

#include "server/gl/context.h"
#include "server/gl/program.h"
#include "server/gl/texture.h"

namespace drape::gl {
namespace {

using testing::ElementsAre;

class FramebufferTest : public testing::Test {
 protected:
  void SetUp() override {
    Result<std::unique_ptr<Context>> context = Context::Create({});
    ASSERT_TRUE(context.ok()) << context.status().ToString();
    context_ = std::move(context).value();
    glCreateVertexArrays(1, &vertices_);
    glBindVertexArray(vertices_);
  }
  void TearDown() override { glDeleteVertexArrays(1, &vertices_); }

  static Result<Program> Compile(const std::string& vertex, const std::string& fragment) {
    ShaderLibrary library;
    library.Add("a.vert", vertex);
    library.Add("a.frag", fragment);
    const Result<ShaderSource> vertex_source = library.Assemble("a.vert", "");
    const Result<ShaderSource> fragment_source = library.Assemble("a.frag", "");
    if (!vertex_source.ok()) return vertex_source.status();
    if (!fragment_source.ok()) return fragment_source.status();
    return Program::CompileDraw(vertex_source.value(), fragment_source.value());
  }

 private:
  std::unique_ptr<Context> context_;
  GLuint vertices_ = 0;
};

// A triangle over the left lower half of the square.
constexpr const char* kHalf = R"(
void main() {
  gl_Position = vec4(gl_VertexID == 1 ? 1 : -1, gl_VertexID == 2 ? 1 : -1, 0, 1);
}
)";
// Over everything.
constexpr const char* kAll = R"(
void main() {
  gl_Position = vec4(gl_VertexID == 1 ? 3 : -1, gl_VertexID == 2 ? 3 : -1, 0.25, 1);
}
)";
constexpr const char* kGrey = R"(
out vec4 colour;
void main() { colour = vec4(0.2158605, 0.2158605, 0.2158605, 1); }
)";

// As it is stored, and 1000 times the depth of a sample; the mean of four.
std::string PackOf(uint32_t samples) {
  const std::string kind = samples == 1 ? "sampler2D" : "sampler2DMS";
  return "layout(binding = 0) uniform " + kind + " colours;\nlayout(binding = 1) uniform " + kind +
         " depths;\nconst int kSamples = " + std::to_string(samples) + R"(;
layout(location = 0) out vec4 colour;
layout(location = 1) out float number;
void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  colour = vec4(0);
  for (int k = 0; k < kSamples; ++k) colour += texelFetch(colours, pixel, k) / kSamples;
  number = 1000.0 * texelFetch(depths, pixel, 0).r;
}
)";
}

std::array<int, 3> Pixel(const std::vector<uint8_t>& rgb, size_t width, size_t x, size_t y) {
  const uint8_t* pixel = &rgb[3 * (y * width + x)];
  return {pixel[0], pixel[1], pixel[2]};
}

TEST_F(FramebufferTest, LinearColoursAreStoredAsSrgb) {
  const Result<Program> program = Compile(kHalf, kGrey);
  ASSERT_TRUE(program.ok()) << program.status().ToString();
  for (const uint32_t samples : {1u, 4u}) {
    SCOPED_TRACE(samples);
    const Result<Program> pack = Compile(kAll, PackOf(samples));
    ASSERT_TRUE(pack.ok()) << pack.status().ToString();
    Result<PictureTarget> target = PictureTarget::Create(8, 12, samples);
    ASSERT_TRUE(target.ok()) << target.status().ToString();
    EXPECT_EQ(target->samples(), samples);
    EXPECT_EQ(target->row_count(), 12u);
    target->UseRows(8);
    target->Begin();
    glClearColor(1, 1, 1, 1);
    glClearDepth(0.5);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    program->Use();
    glEnable(GL_FRAMEBUFFER_SRGB);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glDisable(GL_FRAMEBUFFER_SRGB);
    target->BeginPacking(0, 1);
    pack->Use();
    glDrawArrays(GL_TRIANGLES, 0, 3);
    const std::vector<uint8_t> rgb = target->ReadColours();
    ASSERT_EQ(rgb.size(), 3u * 8 * 8);
    // 0.2158605 is 128 / 255 in sRGB; the lowest row is first.
    EXPECT_THAT(Pixel(rgb, 8, 0, 0), ElementsAre(128, 128, 128));
    EXPECT_THAT(Pixel(rgb, 8, 7, 7), ElementsAre(255, 255, 255));
    // Across the edge one of four samples to three of them, the mean as the shader takes it.
    const int edge = Pixel(rgb, 8, 3, 4)[0];
    if (samples == 4) {
      EXPECT_GT(edge, 128 + 25);
      EXPECT_LT(edge, 255 - 25);
    } else {
      EXPECT_TRUE(edge == 128 || edge == 255) << edge;
    }
    EXPECT_THAT(target->ReadNumbers(), testing::AllOf(testing::SizeIs(64u), testing::Each(500)));
  }
}

// As the blending of what is half transparent has to.
TEST_F(FramebufferTest, BlendingIsInLinearLight) {
  const Result<Program> half =
      Compile(kAll, "out vec4 colour;\nvoid main() { colour = vec4(0, 0, 0, 0.5); }\n");
  const Result<Program> pack = Compile(kAll, PackOf(1));
  ASSERT_TRUE(half.ok() && pack.ok());
  const Result<PictureTarget> target = PictureTarget::Create(2, 2, 1);
  ASSERT_TRUE(target.ok());
  target->Begin();
  glEnable(GL_FRAMEBUFFER_SRGB);
  glClearColor(1, 1, 1, 1);
  glClear(GL_COLOR_BUFFER_BIT);
  glEnable(GL_BLEND);
  glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
  half->Use();
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glDisable(GL_BLEND);
  glDisable(GL_FRAMEBUFFER_SRGB);
  target->BeginPacking(0, 1);
  pack->Use();
  glDrawArrays(GL_TRIANGLES, 0, 3);
  // Half the light is 188 / 255 in sRGB.
  EXPECT_NEAR(Pixel(target->ReadColours(), 2, 1, 1)[0], 188, 1);
}

TEST_F(FramebufferTest, WhatIsTooLargeIsRefused) {
  const Result<PictureTarget> target = PictureTarget::Create(1u << 24, 1, 4);
  ASSERT_FALSE(target.ok());
  EXPECT_EQ(target.status().code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(target.status().reason(), "DEVICE_MEMORY");
  EXPECT_NE(target.status().message().find("16777216 x 1"), std::string::npos);
}

TEST_F(FramebufferTest, ADepthMapIsComparedWith) {
  const Result<Program> depth = Compile(kAll, "void main() {}");
  ASSERT_TRUE(depth.ok()) << depth.status().ToString();
  const Result<Program> compare = Compile(kAll, R"(
layout(binding = 0) uniform sampler2DShadow map;
out vec4 colour;
void main() {
  // Before what is in the map, behind it, and behind it but beyond the edge.
  colour = vec4(texture(map, vec3(0.5, 0.5, 0.1)), texture(map, vec3(0.5, 0.5, 0.9)),
                texture(map, vec3(1.5, 0.5, 0.9)), 1);
}
)");
  ASSERT_TRUE(compare.ok()) << compare.status().ToString();
  const Result<Program> pack = Compile(kAll, PackOf(1));
  ASSERT_TRUE(pack.ok()) << pack.status().ToString();
  const Result<DepthMap> map = DepthMap::Create(16);
  ASSERT_TRUE(map.ok()) << map.status().ToString();
  const Result<PictureTarget> target = PictureTarget::Create(4, 4, 1);
  ASSERT_TRUE(target.ok()) << target.status().ToString();
  glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
  map->Begin();
  glEnable(GL_DEPTH_TEST);
  glClear(GL_DEPTH_BUFFER_BIT);
  depth->Use();
  glDrawArrays(GL_TRIANGLES, 0, 3);
  target->Begin();
  glDisable(GL_DEPTH_TEST);
  map->BindTexture(0);
  compare->Use();
  glDrawArrays(GL_TRIANGLES, 0, 3);
  target->BeginPacking(0, 1);
  pack->Use();
  glDrawArrays(GL_TRIANGLES, 0, 3);
  EXPECT_THAT(Pixel(target->ReadColours(), 4, 2, 2), ElementsAre(255, 0, 255));
}

TEST_F(FramebufferTest, GreyTexturesAreReadByTexel) {
  const std::array<uint8_t, 6> texels = {0, 51, 102, 153, 204, 255};
  const Result<GreyTexture> texture = GreyTexture::Create(3, 2, texels);
  ASSERT_TRUE(texture.ok()) << texture.status().ToString();
  const Result<Program> program = Compile(kAll, R"(
layout(binding = 1) uniform sampler2D image;
out vec4 colour;
void main() { colour = vec4(texture(image, vec2(0.2, 0.2)).r, texture(image, vec2(0.9, 0.2)).r,
                            texture(image, vec2(0.9, 0.9)).r, 1); }
)");
  ASSERT_TRUE(program.ok()) << program.status().ToString();
  const Result<PictureTarget> target = PictureTarget::Create(4, 4, 1);
  ASSERT_TRUE(target.ok());
  target->Begin();
  texture->Bind(1);
  glEnable(GL_FRAMEBUFFER_SRGB);
  program->Use();
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glDisable(GL_FRAMEBUFFER_SRGB);
  const Result<Program> pack = Compile(kAll, PackOf(1));
  ASSERT_TRUE(pack.ok()) << pack.status().ToString();
  target->BeginPacking(0, 1);
  pack->Use();
  glDrawArrays(GL_TRIANGLES, 0, 3);
  // 102 / 255 in linear light is 170 / 255 in sRGB.
  EXPECT_THAT(Pixel(target->ReadColours(), 4, 1, 1), ElementsAre(0, 170, 255));
}

TEST_F(FramebufferTest, ADrawProgramThatDoesNotCompileNamesItsFile) {
  const Result<Program> broken =
      Compile(kAll, "out vec4 colour;\nvoid main() { colour = wrong; }\n");
  ASSERT_FALSE(broken.ok());
  EXPECT_EQ(broken.status().reason(), "SHADER_COMPILE_FAILED");
  EXPECT_NE(broken.status().message().find("a.frag:2"), std::string::npos)
      << broken.status().message();
}

}  // namespace
}  // namespace drape::gl
