// The drawing passes. In every call the context must be current and a target bound.
#pragma once

#include <epoxy/gl.h>

#include <map>
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
#include "server/render/gl_draw/page_layout.h"
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

// The faces of solids that are drawn equally finely, kept for the next picture.
struct SolidFaces {
  uint32_t quarter_faces = 0;
  GLsizei index_count = 0;
  gl::Buffer indices;
};
class SolidFaceCache {
 public:
  // RESOURCE_EXHAUSTED (DEVICE_MEMORY).
  Result<const SolidFaces*> Acquire(uint32_t quarter_faces);

 private:
  std::map<uint32_t, SolidFaces> faces_;  // by quarter_faces, of which there are few
};

// What one tile shows; a picture that is not tiled has one tile.
struct TileContent {
  std::vector<ClothGroup> groups;
  SceneView view;
  ColliderShapes shapes;
  std::vector<shader::LabelRecord> legend{};
};

// Elements of an array of the scene.
struct Run {
  GLuint first = 0;
  GLuint count = 0;
};

struct SolidRun {
  Run run;
  const SolidFaces* faces = nullptr;
};

// Where the things of one tile are in the arrays of the scene.
struct DrawnTile {
  std::vector<ClothGroup> groups;
  std::vector<SolidRun> solids;
  Run planes;
  Run meshes;
  Run labels;
};

// Everything on the device that belongs to one page.
struct DrawnScene {
  const PictureSpec& spec;
  const ClothSet& cloths;
  PageLayout layout;
  std::vector<DrawnTile> tiles;
  gl::Buffer frames;        // of each tile a DrawFrame, then of each the one of its shadow map
  gl::Buffer groups;        // [] vec4; colours of the groups of constraints
  gl::Buffer solids;        // [] SolidRecord
  gl::Buffer planes;        // [] PlaneRecord
  gl::Buffer mesh_records;  // [] SolidRecord, one per mesh
  gl::Buffer labels;        // [] LabelRecord
  std::vector<DrawnMesh> meshes;
};

// `faces` must outlive the scene. RESOURCE_EXHAUSTED (DEVICE_MEMORY; PICTURE_TOO_LARGE for more
// than kMaxMeshTriangles in a tile).
Result<DrawnScene> LoadScene(const PictureSpec& spec, const ClothSet& cloths,
                             const PageLayout& layout, std::span<const TileContent> tiles,
                             uint32_t group_count, SolidFaceCache& faces);

// Draws the depths seen by the key light into `map`.
void DrawShadows(const DrawPrograms& programs, const VertexArray& vertices, const DrawnScene& scene,
                 const gl::DepthMap& map);
// The colours of the particles of cloths that are lit there.
void LightParticles(const DrawPrograms& programs, const DrawnScene& scene, const gl::DepthMap& map);
// Draws cloths, pins, colliders, and last the planes, which are transparent at their edges.
void DrawScene(const DrawPrograms& programs, const VertexArray& vertices, const DrawnScene& scene,
               const gl::DepthMap& map);
// The depths of the planes, which DrawScene leaves out because it blends them. After DrawScene.
void DrawPlaneDepths(const DrawPrograms& programs, const DrawnScene& scene);
// Draws over the pictures.
void DrawLabels(const DrawPrograms& programs, const DrawnScene& scene);
// Puts the backdrop behind what was drawn: the pixels and distances [m] of the tiles, one below the
// other, the top row of the first tile first.
void PackPictures(const DrawPrograms& programs, const DrawnScene& scene,
                  const gl::PictureTarget& target);

}  // namespace drape::render
