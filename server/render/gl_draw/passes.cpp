#include "server/render/gl_draw/passes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>

#include "server/render/gl_draw/mesh_corners.h"
#include "server/render/gl_draw/palette.h"
#include "server/render/gl_draw/projection.h"
#include "server/render/gl_draw/solid_faces.h"
#include "server/render/render_thread.h"
#include "shaders/interface/draw_bindings.h"

namespace drape::render {

namespace {

using Eigen::Vector3d;

// Uploads an array, at least one element, because OpenGL has no empty buffers.
template <class T>
Result<gl::Buffer> UploadArray(std::vector<T> elements) {
  if (elements.empty()) elements.emplace_back();
  const auto bytes = std::as_bytes(std::span(elements));
  Result<gl::Buffer> buffer = gl::Buffer::Create(bytes.size());
  if (buffer.ok()) buffer->Upload(0, bytes);
  return buffer;
}

shader::PlaneRecord MakePlane(const DrawnPlane& plane, const SceneView& view) {
  const Vector3d& normal = plane.normal;
  const Vector3d hint = std::abs(normal.x()) < 0.9 ? Vector3d::UnitX() : Vector3d::UnitZ();
  const Vector3d bitangent = normal.cross(hint).normalized();
  const Vector3d tangent = bitangent.cross(normal);
  // Below the middle of the picture; slightly lower than it is, because cloth lies on it.
  const double height = normal.dot(view.floor_center_m - plane.point_m);
  const Vector3d center = view.floor_center_m - (height + 0.002 * view.floor_radius_m) * normal;
  // The grid spacing is a power of ten: 1 m in scenes of the size of a person.
  const double cell = std::pow(10, std::round(std::log10(view.floor_radius_m)));
  const auto phase = [&](const Vector3d& axis) { return std::remainder(axis.dot(center), cell); };
  return {.center = ToShader(Vector3d(center - view.camera.eye_m), 6 * view.floor_radius_m),
          .tangent = ToShader(tangent, phase(tangent)),
          .bitangent = ToShader(bitangent, phase(bitangent)),
          .grid = {static_cast<float>(cell), 0, 0, 0}};
}

void Prepare(const VertexArray& vertices, GLenum depth_func) {
  glBindVertexArray(vertices.name());
  glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
  glEnable(GL_DEPTH_TEST);
  glDepthMask(GL_TRUE);
  glDepthFunc(depth_func);
  glDisable(GL_BLEND);
  glDisable(GL_CULL_FACE);
}

// Frames of the uniform block begin at multiples of this: the largest alignment that OpenGL lets a
// device ask for.
constexpr size_t kFrameAlignment_bytes = 256;
constexpr size_t kFramePitch_bytes = (sizeof(shader::DrawFrame) + kFrameAlignment_bytes - 1) /
                                     kFrameAlignment_bytes * kFrameAlignment_bytes;

// The two images that a page is drawn into.
enum class Pass { kShadows, kPicture };

void BindFrame(const DrawnScene& scene, Pass pass, uint32_t tile) {
  const size_t frame = tile + (pass == Pass::kShadows ? scene.layout.tile_count : 0);
  scene.frames.BindUniforms(DRAPE_DRAW_BINDING_FRAME, frame * kFramePitch_bytes,
                            sizeof(shader::DrawFrame));
}

// Subsequent draws are of this tile: seen by its viewer, and within its part of the image.
void BeginTile(const DrawnScene& scene, Pass pass, uint32_t tile) {
  BindFrame(scene, pass, tile);
  const PixelBox box =
      pass == Pass::kShadows ? scene.layout.ShadowOf(tile) : scene.layout.PictureOf(tile);
  const auto [x, y, width, height] =
      std::array{static_cast<GLint>(box.x), static_cast<GLint>(box.y),
                 static_cast<GLint>(box.width), static_cast<GLint>(box.height)};
  glViewport(x, y, width, height);
  glScissor(x, y, width, height);
}

// Over what is there, in linear light; the alpha becomes what hides the backdrop.
void Blend() {
  glEnable(GL_FRAMEBUFFER_SRGB);
  glEnable(GL_BLEND);
  glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
}

void Use(const gl::Program& program, const DrawnScene& scene) {
  program.Use();
  program.SetUniform(DRAPE_DRAW_UNIFORM_COLOURING, ColouringNumber(scene.spec.colouring));
}

void DrawSurface(const gl::Program& program, const VertexArray& vertices, const ClothGroup& group) {
  program.Use();
  program.SetUniform(DRAPE_DRAW_UNIFORM_FIRST_CLOTH, group.first);
  glVertexArrayElementBuffer(vertices.name(), group.geometry->indices.name());
  glDrawElementsInstanced(GL_TRIANGLES, static_cast<GLsizei>(group.geometry->index_count),
                          GL_UNSIGNED_INT, nullptr, static_cast<GLsizei>(group.count));
}

void DrawParticleBalls(const gl::Program& program, const DrawnScene& scene, const ClothGroup& group,
                       GLuint kind) {
  program.Use();
  program.SetUniform(DRAPE_DRAW_UNIFORM_BALL_KIND, kind);
  const shader::DrawRecord& record = scene.cloths.record(group.first);
  const GLuint count = kind == DRAPE_DRAW_BALL_PINS ? record.pin_count : record.particle_count;
  if (count == 0) return;
  for (uint32_t cloth = 0; cloth < group.count; ++cloth) {
    program.SetUniform(DRAPE_DRAW_UNIFORM_FIRST_CLOTH, group.first + cloth);
    glDrawArraysInstanced(GL_TRIANGLES, 0, DRAPE_DRAW_DISC_VERTICES, static_cast<GLsizei>(count));
  }
}

struct ClothPrograms {
  const gl::Program& surface;
  const gl::Program& lit_surface;  // of cloths that are lit at their particles
  const gl::Program& lines;
  const gl::Program& balls;
};

void DrawCloth(const ClothPrograms& programs, const VertexArray& vertices, const DrawnScene& scene,
               const ClothGroup& group) {
  const shader::DrawRecord& record = scene.cloths.record(group.first);
  const bool has_surface = record.has_surface != 0;
  if (has_surface) {
    DrawSurface(group.is_lit_at_particles ? programs.lit_surface : programs.surface, vertices,
                group);
  }
  const bool has_lines = !has_surface || scene.spec.colouring == Colouring::kColourGroup;
  if (has_lines && record.constraint_count > 0) {
    programs.lines.Use();
    programs.lines.SetUniform(DRAPE_DRAW_UNIFORM_FIRST_CLOTH, group.first);
    glDrawArraysInstanced(GL_TRIANGLES, 0, static_cast<GLsizei>(6 * record.constraint_count),
                          static_cast<GLsizei>(group.count));
  }
  if (!has_surface) DrawParticleBalls(programs.balls, scene, group, DRAPE_DRAW_BALL_PARTICLES);
  if (scene.spec.has_pins) DrawParticleBalls(programs.balls, scene, group, DRAPE_DRAW_BALL_PINS);
}

void DrawCloths(const ClothPrograms& programs, const VertexArray& vertices, const DrawnScene& scene,
                Pass pass) {
  for (const gl::Program* program : {&programs.surface, &programs.lines, &programs.balls}) {
    Use(*program, scene);
  }
  scene.groups.BindStorage(DRAPE_DRAW_BINDING_INSTANCES);
  glEnable(GL_CLIP_DISTANCE0);
  for (uint32_t tile = 0; tile < scene.tiles.size(); ++tile) {
    BeginTile(scene, pass, tile);
    for (const ClothGroup& group : scene.tiles[tile].groups) {
      scene.cloths.Bind(group);
      DrawCloth(programs, vertices, scene, group);
    }
  }
  glDisable(GL_CLIP_DISTANCE0);
}

shader::SolidRecord MakeSolid(const DrawnSolid& solid, const SceneView& view) {
  const auto axis = [&solid](int k) {
    return ToShader(Vector3d(solid.axes.col(k)), solid.drawn_half_extents_m[k]);
  };
  return {.center = ToShader(Vector3d(solid.center_m - view.camera.eye_m), solid.drawn_radius_m),
          .axis_x = axis(0),
          .axis_y = axis(1),
          .axis_z = axis(2),
          .colour = LinearFromHex(0xb4bac4)};
}

void DrawInstances(const gl::Program& program, GLsizei vertex_count, const Run& run) {
  program.SetUniform(DRAPE_DRAW_UNIFORM_FIRST_INSTANCE, run.first);
  glDrawArraysInstanced(GL_TRIANGLES, 0, vertex_count, static_cast<GLsizei>(run.count));
}

void DrawSolids(const gl::Program& program, const VertexArray& vertices, const DrawnScene& scene,
                Pass pass) {
  program.Use();
  scene.solids.BindStorage(DRAPE_DRAW_BINDING_INSTANCES);
  for (uint32_t tile = 0; tile < scene.tiles.size(); ++tile) {
    if (scene.tiles[tile].solids.empty()) continue;
    BeginTile(scene, pass, tile);
    for (const auto& [run, faces] : scene.tiles[tile].solids) {
      program.SetUniform(DRAPE_DRAW_UNIFORM_FIRST_INSTANCE, run.first);
      program.SetUniform(DRAPE_DRAW_UNIFORM_QUARTER_FACES, faces->quarter_faces);
      glVertexArrayElementBuffer(vertices.name(), faces->indices.name());
      glDrawElementsInstanced(GL_TRIANGLES, faces->index_count, GL_UNSIGNED_INT, nullptr,
                              static_cast<GLsizei>(run.count));
    }
  }
}

void DrawMeshes(const gl::Program& program, const DrawnScene& scene, Pass pass) {
  program.Use();
  scene.mesh_records.BindStorage(DRAPE_DRAW_BINDING_INSTANCES);
  for (uint32_t tile = 0; tile < scene.tiles.size(); ++tile) {
    const Run& meshes = scene.tiles[tile].meshes;
    if (meshes.count == 0) continue;
    BeginTile(scene, pass, tile);
    for (GLuint k = meshes.first; k < meshes.first + meshes.count; ++k) {
      program.SetUniform(DRAPE_DRAW_UNIFORM_MESH, k);
      scene.meshes[k].corners->BindStorage(DRAPE_DRAW_BINDING_SURFACE);
      glDrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(scene.meshes[k].corner_count));
    }
  }
}

void DrawPlanes(const gl::Program& program, const DrawnScene& scene) {
  program.Use();
  scene.planes.BindStorage(DRAPE_DRAW_BINDING_INSTANCES);
  for (uint32_t tile = 0; tile < scene.tiles.size(); ++tile) {
    const Run& planes = scene.tiles[tile].planes;
    if (planes.count == 0) continue;
    BeginTile(scene, Pass::kPicture, tile);
    DrawInstances(program, 3, planes);
  }
}

// A mesh as it is drawn: equal ones are uploaded once.
using MeshKey = std::pair<const TriangleMesh*, std::array<double, 4>>;  // scale, inset [m]

MeshKey KeyOf(const DrawnSolid& solid, double inset_m) {
  const Vector3d& scale = solid.mesh_scale;
  return {solid.mesh.get(), {scale.x(), scale.y(), scale.z(), inset_m}};
}

std::vector<float> CornersOf(const DrawnSolid& solid, double inset_m) {
  if (solid.mesh_scale == Vector3d::Ones()) {
    return MeshCorners(*solid.mesh, solid.mesh_center_m, inset_m);
  }
  TriangleMesh scaled = *solid.mesh;
  for (Vector3d& p : scaled.positions_m) p = p.cwiseProduct(solid.mesh_scale);
  return MeshCorners(scaled, solid.mesh_center_m, inset_m);
}

// The meshes of the tiles of a page.
class MeshLoader {
 public:
  // Of one tile: each mesh is drawn with the largest inset that the tile has for it.
  Result<Run> Add(std::span<const DrawnSolid> solids) {
    std::map<const TriangleMesh*, double> insets_m;
    uint64_t triangle_count = 0;
    for (const DrawnSolid& solid : solids) {
      const auto [inset_m, is_new] = insets_m.try_emplace(solid.mesh.get(), solid.inset_m);
      inset_m->second = std::max(inset_m->second, solid.inset_m);
      const bool is_scaled = solid.mesh_scale != Vector3d::Ones();
      if (is_new || is_scaled) triangle_count += solid.mesh->triangles.size();
    }
    if (triangle_count > kMaxMeshTriangles) {
      return PictureTooLarge("the limit of triangles of mesh and cylinder colliders",
                             triangle_count, kMaxMeshTriangles);
    }
    const Run run{static_cast<GLuint>(meshes_.size()), static_cast<GLuint>(solids.size())};
    for (const DrawnSolid& solid : solids) {
      const double inset_m = insets_m.at(solid.mesh.get());
      std::shared_ptr<const gl::Buffer>& corners = loaded_[KeyOf(solid, inset_m)];
      if (corners == nullptr) {
        DRAPE_ASSIGN_OR_RETURN(gl::Buffer buffer, UploadArray(CornersOf(solid, inset_m)));
        corners = std::make_shared<const gl::Buffer>(std::move(buffer));
      }
      meshes_.push_back({corners, static_cast<GLuint>(3 * solid.mesh->triangles.size())});
    }
    return run;
  }
  std::vector<DrawnMesh> Take() { return std::move(meshes_); }

 private:
  std::map<MeshKey, std::shared_ptr<const gl::Buffer>> loaded_;
  std::vector<DrawnMesh> meshes_;
};

// What the tiles of a page upload.
struct SceneArrays {
  std::vector<shader::SolidRecord> solids, mesh_records;
  std::vector<shader::PlaneRecord> planes;
  std::vector<shader::LabelRecord> labels;
  MeshLoader meshes;
};

template <class T>
Run Append(const std::vector<T>& added, std::vector<T>& all) {
  const Run run{static_cast<GLuint>(all.size()), static_cast<GLuint>(added.size())};
  all.insert(all.end(), added.begin(), added.end());
  return run;
}

// Those without a mesh.
Result<std::vector<SolidRun>> AddSolids(const PictureSpec& spec, const TileContent& content,
                                        SolidFaceCache& cache, SceneArrays& arrays) {
  std::map<uint32_t, std::vector<shader::SolidRecord>> by_faces;
  for (const DrawnSolid& solid : content.shapes.solids) {
    if (solid.mesh) continue;
    by_faces[QuarterFaces(solid, content.shapes.solids.size(), content.view.camera, spec.height_px)]
        .push_back(MakeSolid(solid, content.view));
  }
  std::vector<SolidRun> runs;
  for (const auto& [quarter_faces, solids] : by_faces) {
    DRAPE_ASSIGN_OR_RETURN(const SolidFaces* faces, cache.Acquire(quarter_faces));
    runs.push_back({Append(solids, arrays.solids), faces});
  }
  return runs;
}

Result<DrawnTile> AddTile(const PictureSpec& spec, const TileContent& content,
                          SolidFaceCache& cache, SceneArrays& arrays) {
  DrawnTile tile;
  tile.groups = content.groups;
  tile.labels = Append(content.legend, arrays.labels);
  if (!spec.has_colliders) return tile;
  DRAPE_ASSIGN_OR_RETURN(tile.solids, AddSolids(spec, content, cache, arrays));
  std::vector<shader::SolidRecord> mesh_records;
  std::vector<DrawnSolid> mesh_solids;
  std::vector<shader::PlaneRecord> planes;
  for (const DrawnSolid& solid : content.shapes.solids) {
    if (!solid.mesh) continue;
    mesh_records.push_back(MakeSolid(solid, content.view));
    mesh_solids.push_back(solid);
  }
  for (const DrawnPlane& plane : content.shapes.planes) {
    planes.push_back(MakePlane(plane, content.view));
  }
  tile.planes = Append(planes, arrays.planes);
  Append(mesh_records, arrays.mesh_records);
  DRAPE_ASSIGN_OR_RETURN(tile.meshes, arrays.meshes.Add(mesh_solids));
  return tile;
}

Result<gl::Buffer> UploadFrames(std::span<const TileContent> tiles) {
  std::vector<std::byte> bytes(2 * tiles.size() * kFramePitch_bytes);
  for (size_t k = 0; k < tiles.size(); ++k) {
    std::memcpy(&bytes[k * kFramePitch_bytes], &tiles[k].view.frame, sizeof(shader::DrawFrame));
    std::memcpy(&bytes[(tiles.size() + k) * kFramePitch_bytes], &tiles[k].view.shadow_frame,
                sizeof(shader::DrawFrame));
  }
  return UploadArray(std::move(bytes));
}

}  // namespace

Result<const SolidFaces*> SolidFaceCache::Acquire(uint32_t quarter_faces) {
  const auto [entry, is_new] = faces_.try_emplace(quarter_faces);
  if (!is_new) return &entry->second;
  std::vector<uint32_t> indices = SolidIndices(quarter_faces);
  const auto index_count = static_cast<GLsizei>(indices.size());
  Result<gl::Buffer> buffer = UploadArray(std::move(indices));
  if (!buffer.ok()) {
    faces_.erase(entry);
    return buffer.status();
  }
  entry->second = {quarter_faces, index_count, std::move(*buffer)};
  return &entry->second;
}

Result<DrawnScene> LoadScene(const PictureSpec& spec, const ClothSet& cloths,
                             const PageLayout& layout, std::span<const TileContent> tiles,
                             uint32_t group_count, SolidFaceCache& faces) {
  DrawnScene scene{.spec = spec,
                   .cloths = cloths,
                   .layout = layout,
                   .tiles = {},
                   .frames = {},
                   .groups = {},
                   .solids = {},
                   .planes = {},
                   .mesh_records = {},
                   .labels = {},
                   .meshes = {}};
  SceneArrays arrays;
  for (const TileContent& content : tiles) {
    DRAPE_ASSIGN_OR_RETURN(DrawnTile tile, AddTile(spec, content, faces, arrays));
    scene.tiles.push_back(std::move(tile));
  }
  scene.meshes = arrays.meshes.Take();
  std::vector<shader::vec4> group_colours;
  for (uint32_t group = 0; group < group_count; ++group) {
    group_colours.push_back(GroupColour(group));
  }
  DRAPE_ASSIGN_OR_RETURN(scene.frames, UploadFrames(tiles));
  const auto load = [](auto elements, gl::Buffer& target) -> Status {
    DRAPE_ASSIGN_OR_RETURN(target, UploadArray(std::move(elements)));
    return Status::Ok();
  };
  DRAPE_RETURN_IF_ERROR(load(std::move(group_colours), scene.groups));
  DRAPE_RETURN_IF_ERROR(load(std::move(arrays.solids), scene.solids));
  DRAPE_RETURN_IF_ERROR(load(std::move(arrays.planes), scene.planes));
  DRAPE_RETURN_IF_ERROR(load(std::move(arrays.mesh_records), scene.mesh_records));
  DRAPE_RETURN_IF_ERROR(load(std::move(arrays.labels), scene.labels));
  return scene;
}

void DrawShadows(const DrawPrograms& programs, const VertexArray& vertices, const DrawnScene& scene,
                 const gl::DepthMap& map) {
  map.Begin();
  Prepare(vertices, GL_LESS);
  glClearDepth(1);
  glClear(GL_DEPTH_BUFFER_BIT);
  if (!scene.spec.has_shadows) return;
  // Solids that extend beyond the light's box still cast shadows.
  glEnable(GL_DEPTH_CLAMP);
  glEnable(GL_SCISSOR_TEST);
  DrawSolids(programs.solids_depth, vertices, scene, Pass::kShadows);
  DrawMeshes(programs.meshes_depth, scene, Pass::kShadows);
  DrawCloths({programs.cloth_depth, programs.cloth_depth, programs.lines_depth,
              programs.particle_balls_depth},
             vertices, scene, Pass::kShadows);
  glDisable(GL_SCISSOR_TEST);
  glDisable(GL_DEPTH_CLAMP);
}

void LightParticles(const DrawPrograms& programs, const DrawnScene& scene,
                    const gl::DepthMap& map) {
  map.BindTexture(DRAPE_DRAW_UNIT_SHADOW);
  bool has_any = false;
  for (uint32_t tile = 0; tile < scene.tiles.size(); ++tile) {
    for (const ClothGroup& group : scene.tiles[tile].groups) {
      if (!group.is_lit_at_particles) continue;
      BindFrame(scene, Pass::kPicture, tile);
      scene.cloths.Light(programs.light_particles, group);
      has_any = true;
    }
  }
  if (has_any) glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
}

void DrawScene(const DrawPrograms& programs, const VertexArray& vertices, const DrawnScene& scene,
               const gl::DepthMap& map) {
  Prepare(vertices, GL_GREATER);
  glDisable(GL_FRAMEBUFFER_SRGB);
  glClearColor(0, 0, 0, 0);
  glClearDepth(0);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  glEnable(GL_SCISSOR_TEST);
  map.BindTexture(DRAPE_DRAW_UNIT_SHADOW);
  // Cloths hide much of what they lie on, which then costs no light.
  DrawCloths({programs.cloth, programs.lit_cloth, programs.lines, programs.particle_balls},
             vertices, scene, Pass::kPicture);
  DrawSolids(programs.solids, vertices, scene, Pass::kPicture);
  DrawMeshes(programs.meshes, scene, Pass::kPicture);
  Blend();
  glDepthMask(GL_FALSE);
  DrawPlanes(programs.planes, scene);
  glDisable(GL_SCISSOR_TEST);
}

void DrawPlaneDepths(const DrawPrograms& programs, const DrawnScene& scene) {
  glEnable(GL_SCISSOR_TEST);
  glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  glDepthMask(GL_TRUE);
  DrawPlanes(programs.planes_depth, scene);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  glDisable(GL_SCISSOR_TEST);
}

void DrawLabels(const DrawPrograms& programs, const DrawnScene& scene) {
  glDisable(GL_DEPTH_TEST);
  // Pixels are covered or not, as they lie: text is made for them.
  glDisable(GL_MULTISAMPLE);
  Blend();
  programs.labels.Use();
  scene.labels.BindStorage(DRAPE_DRAW_BINDING_INSTANCES);
  for (uint32_t tile = 0; tile < scene.tiles.size(); ++tile) {
    const Run& labels = scene.tiles[tile].labels;
    if (labels.count == 0) continue;
    BeginTile(scene, Pass::kPicture, tile);
    DrawInstances(programs.labels, 6, labels);
  }
  glEnable(GL_MULTISAMPLE);
}

void PackPictures(const DrawPrograms& programs, const DrawnScene& scene,
                  const gl::PictureTarget& target) {
  target.BeginPacking(DRAPE_DRAW_UNIT_COLOURS, DRAPE_DRAW_UNIT_DEPTHS);
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_BLEND);
  glDisable(GL_FRAMEBUFFER_SRGB);
  const gl::Program& program = target.samples() == 1 ? programs.pack_one : programs.pack_four;
  program.Use();
  program.SetUniform(DRAPE_DRAW_UNIFORM_ROWS, target.row_count());
  const auto [width, height] = std::array{static_cast<GLsizei>(scene.layout.width_px),
                                          static_cast<GLsizei>(scene.layout.height_px)};
  for (uint32_t tile = 0; tile < scene.tiles.size(); ++tile) {
    BindFrame(scene, Pass::kPicture, tile);
    glViewport(0, static_cast<GLint>(tile) * height, width, height);
    glDrawArrays(GL_TRIANGLES, 0, 3);
  }
}

}  // namespace drape::render
