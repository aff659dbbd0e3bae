// What is drawn, in which order. Every call with the context current and something to draw into.
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

// Of the different meshes of a picture together: 288 MiB of corners.
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

// A mesh collider: corners (mesh_corners.h), and its record in DrawnScene::mesh_records.
struct DrawnMesh {
  std::shared_ptr<const gl::Buffer> corners;  // shared by all colliders of the mesh
  GLuint corner_count = 0;
};

// Everything of one picture on the device.
struct DrawnScene {
  const PictureSpec& spec;
  const ClothSet& cloths;
  gl::Buffer frame;         // DrawFrame
  gl::Buffer shadow_frame;  // DrawFrame
  gl::Buffer groups;        // [] vec4; of the groups of constraints
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

// Depths as the key light sees them, into `map`.
void DrawShadows(const DrawPrograms& programs, const VertexArray& vertices, const DrawnScene& scene,
                 const gl::DepthMap& map);
// Backdrop, colliders, cloths, pins, and last the planes, which let see through at their edges.
void DrawScene(const DrawPrograms& programs, const VertexArray& vertices, const DrawnScene& scene,
               const gl::DepthMap& map);
// Over what is there.
Status DrawLabels(const DrawPrograms& programs, const DrawnScene& scene,
                  std::span<const shader::LabelRecord> labels);

}  // namespace drape::render
