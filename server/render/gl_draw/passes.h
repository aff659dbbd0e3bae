// The drawing passes. In every call the context must be current and a target bound.
#pragma once

#include <epoxy/gl.h>

#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "server/core/status.h"
#include "server/gl/buffer.h"
#include "server/gl/framebuffer.h"
#include "server/render/gl_draw/cloth_set.h"
#include "server/render/gl_draw/collider_shapes.h"
#include "server/render/gl_draw/draw_programs.h"
#include "server/render/gl_draw/scene_view.h"
#include "server/render/picture_spec.h"

namespace drape::render {

// Limit of all different meshes of a picture together, those of cylinders included: 288 MiB of
// corners.
inline constexpr uint64_t kMaxMeshTriangles = uint64_t{1} << 22;

// Owns a vertex array object, without which OpenGL does not draw. Move-only.
class VertexArray {
 public:
  VertexArray() { glCreateVertexArrays(1, &name_); }
  ~VertexArray() {
    if (name_ != 0) glDeleteVertexArrays(1, &name_);
  }
  VertexArray(VertexArray&& other) noexcept : name_(std::exchange(other.name_, 0)) {}
  VertexArray& operator=(VertexArray&&) = delete;

  GLuint name() const { return name_; }

 private:
  GLuint name_ = 0;
};

// A mesh or cylinder collider: corners (mesh_corners.h), and its record in
// DrawnScene::mesh_records.
struct DrawnMesh {
  std::shared_ptr<const gl::Buffer> corners;  // shared by all colliders of the mesh
  GLuint corner_count = 0;
};

// Everything on the device that belongs to one picture.
struct DrawnScene {
  const PictureSpec& spec;
  const ClothSet& cloths;
  gl::Buffer frame;         // DrawFrame
  gl::Buffer shadow_frame;  // DrawFrame
  gl::Buffer groups;        // [] vec4; colours of the groups of constraints
  gl::Buffer solids;        // [] SolidRecord
  gl::Buffer planes;        // [] PlaneRecord
  gl::Buffer mesh_records;  // [] SolidRecord, one per mesh
  GLuint solid_count = 0;
  GLuint plane_count = 0;
  std::vector<DrawnMesh> meshes;
};

// RESOURCE_EXHAUSTED (DEVICE_MEMORY; PICTURE_TOO_LARGE for more than kMaxMeshTriangles).
Result<DrawnScene> LoadScene(const PictureSpec& spec, const ClothSet& cloths, const SceneView& view,
                             const ColliderShapes& shapes, uint32_t group_count);

// Draws the depths seen by the key light into `map`.
void DrawShadows(const DrawPrograms& programs, const VertexArray& vertices, const DrawnScene& scene,
                 const gl::DepthMap& map);
// Draws backdrop, colliders, cloths, pins, and last the planes, which are transparent at their
// edges.
void DrawScene(const DrawPrograms& programs, const VertexArray& vertices, const DrawnScene& scene,
               const gl::DepthMap& map);
// The depths of the planes, which DrawScene leaves out because it blends them. After DrawScene.
void DrawPlaneDepths(const DrawPrograms& programs, const DrawnScene& scene);
// Draws over the picture.
Status DrawLabels(const DrawPrograms& programs, const DrawnScene& scene,
                  std::span<const shader::LabelRecord> labels);

}  // namespace drape::render
