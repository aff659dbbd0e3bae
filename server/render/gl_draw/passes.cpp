#include "server/render/gl_draw/passes.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "server/render/gl_draw/mesh_corners.h"
#include "server/render/gl_draw/palette.h"
#include "server/render/gl_draw/projection.h"
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
  const double height = normal.dot(view.center_m - plane.point_m);
  const Vector3d center = view.center_m - (height + 0.002 * view.radius_m) * normal;
  // The grid spacing is a power of ten: 1 m in scenes of the size of a person.
  const double cell = std::pow(10, std::round(std::log10(view.radius_m)));
  const auto phase = [&](const Vector3d& axis) { return std::remainder(axis.dot(center), cell); };
  return {.center = ToShader(Vector3d(center - view.camera.eye_m), 6 * view.radius_m),
          .tangent = ToShader(tangent, phase(tangent)),
          .bitangent = ToShader(bitangent, phase(bitangent)),
          .grid = {static_cast<float>(cell), 0, 0, 0}};
}

void Prepare(const VertexArray& vertices, const gl::Buffer& frame, GLenum depth_func) {
  glBindVertexArray(vertices.name());
  frame.BindUniforms(DRAPE_DRAW_BINDING_FRAME);
  glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
  glEnable(GL_DEPTH_TEST);
  glDepthMask(GL_TRUE);
  glDepthFunc(depth_func);
  glDisable(GL_BLEND);
  glDisable(GL_CULL_FACE);
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
  const gl::Program& lines;
  const gl::Program& balls;
};

void DrawCloths(const ClothPrograms& programs, const VertexArray& vertices,
                const DrawnScene& scene) {
  for (const gl::Program* program : {&programs.surface, &programs.lines, &programs.balls}) {
    Use(*program, scene);
  }
  scene.groups.BindStorage(DRAPE_DRAW_BINDING_INSTANCES);
  glEnable(GL_CLIP_DISTANCE0);
  for (const ClothGroup& group : scene.cloths.groups()) {
    scene.cloths.Bind(group);
    const shader::DrawRecord& record = scene.cloths.record(group.first);
    const bool has_surface = record.has_surface != 0;
    if (has_surface) DrawSurface(programs.surface, vertices, group);
    const bool has_lines = !has_surface || scene.spec.colouring == Colouring::kColourGroup;
    if (has_lines && record.constraint_count > 0) {
      programs.lines.Use();
      programs.lines.SetUniform(DRAPE_DRAW_UNIFORM_FIRST_CLOTH, group.first);
      glDrawArraysInstanced(GL_TRIANGLES, 0, static_cast<GLsizei>(6 * record.constraint_count),
                            static_cast<GLsizei>(group.count));
    }
    if (!has_surface) {
      DrawParticleBalls(programs.balls, scene, group, DRAPE_DRAW_BALL_PARTICLES);
    }
    if (scene.spec.has_pins) DrawParticleBalls(programs.balls, scene, group, DRAPE_DRAW_BALL_PINS);
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

// The faces of a sphere are 1/48 to 1/192 of its circumference wide.
void DrawSolids(const gl::Program& program, const DrawnScene& scene) {
  if (scene.solid_count == 0) return;
  const GLuint segments = scene.solid_count <= 8 ? 96 : scene.solid_count <= 64 ? 48 : 24;
  const GLuint faces = (2 * segments + 4) * (segments + 3);
  program.Use();
  program.SetUniform(DRAPE_DRAW_UNIFORM_SEGMENTS, segments);
  scene.solids.BindStorage(DRAPE_DRAW_BINDING_INSTANCES);
  glDrawArraysInstanced(GL_TRIANGLES, 0, static_cast<GLsizei>(6 * faces),
                        static_cast<GLsizei>(scene.solid_count));
}

void DrawMeshes(const gl::Program& program, const DrawnScene& scene) {
  if (scene.meshes.empty()) return;
  program.Use();
  scene.mesh_records.BindStorage(DRAPE_DRAW_BINDING_INSTANCES);
  for (GLuint k = 0; k < scene.meshes.size(); ++k) {
    program.SetUniform(DRAPE_DRAW_UNIFORM_MESH, k);
    scene.meshes[k].corners->BindStorage(DRAPE_DRAW_BINDING_SURFACE);
    glDrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(scene.meshes[k].corner_count));
  }
}

// One copy of each mesh, drawn with the largest inset that the picture has for it.
Result<std::vector<DrawnMesh>> LoadMeshes(std::span<const DrawnSolid> solids) {
  std::map<const TriangleMesh*, double> insets_m;
  for (const DrawnSolid& solid : solids) {
    double& inset_m = insets_m[solid.mesh.get()];
    inset_m = std::max(inset_m, solid.inset_m);
  }
  uint64_t triangle_count = 0;
  for (const auto& [mesh, inset_m] : insets_m) triangle_count += mesh->triangles.size();
  if (triangle_count > kMaxMeshTriangles) {
    return PictureTooLarge("the limit of triangles of mesh and cylinder colliders", triangle_count,
                           kMaxMeshTriangles);
  }
  std::map<const TriangleMesh*, std::shared_ptr<const gl::Buffer>> loaded;
  std::vector<DrawnMesh> meshes;
  for (const DrawnSolid& solid : solids) {
    const TriangleMesh& mesh = *solid.mesh;
    std::shared_ptr<const gl::Buffer>& corners = loaded[&mesh];
    if (corners == nullptr) {
      DRAPE_ASSIGN_OR_RETURN(gl::Buffer buffer, UploadArray(MeshCorners(mesh, solid.mesh_center_m,
                                                                        insets_m.at(&mesh))));
      corners = std::make_shared<const gl::Buffer>(std::move(buffer));
    }
    meshes.push_back({corners, static_cast<GLuint>(3 * mesh.triangles.size())});
  }
  return meshes;
}

}  // namespace

Result<DrawnScene> LoadScene(const PictureSpec& spec, const ClothSet& cloths, const SceneView& view,
                             const ColliderShapes& shapes, uint32_t group_count) {
  std::vector<shader::vec4> group_colours;
  for (uint32_t group = 0; group < group_count; ++group) {
    group_colours.push_back(GroupColour(group));
  }
  std::vector<shader::SolidRecord> solids, mesh_records;
  std::vector<DrawnSolid> mesh_solids;
  std::vector<shader::PlaneRecord> planes;
  if (spec.has_colliders) {
    for (const DrawnSolid& solid : shapes.solids) {
      (solid.mesh ? mesh_records : solids).push_back(MakeSolid(solid, view));
      if (solid.mesh) mesh_solids.push_back(solid);
    }
    for (const DrawnPlane& plane : shapes.planes) planes.push_back(MakePlane(plane, view));
  }
  DRAPE_ASSIGN_OR_RETURN(std::vector<DrawnMesh> meshes, LoadMeshes(mesh_solids));
  DrawnScene scene{.spec = spec,
                   .cloths = cloths,
                   .frame = {},
                   .shadow_frame = {},
                   .groups = {},
                   .solids = {},
                   .planes = {},
                   .mesh_records = {},
                   .solid_count = static_cast<GLuint>(solids.size()),
                   .plane_count = static_cast<GLuint>(planes.size()),
                   .meshes = std::move(meshes)};
  const auto load = [](auto elements, gl::Buffer& target) -> Status {
    DRAPE_ASSIGN_OR_RETURN(target, UploadArray(std::move(elements)));
    return Status::Ok();
  };
  DRAPE_RETURN_IF_ERROR(load(std::vector{view.frame}, scene.frame));
  DRAPE_RETURN_IF_ERROR(load(std::vector{view.shadow_frame}, scene.shadow_frame));
  DRAPE_RETURN_IF_ERROR(load(std::move(group_colours), scene.groups));
  DRAPE_RETURN_IF_ERROR(load(std::move(solids), scene.solids));
  DRAPE_RETURN_IF_ERROR(load(std::move(planes), scene.planes));
  DRAPE_RETURN_IF_ERROR(load(std::move(mesh_records), scene.mesh_records));
  return scene;
}

void DrawShadows(const DrawPrograms& programs, const VertexArray& vertices, const DrawnScene& scene,
                 const gl::DepthMap& map) {
  map.Begin();
  Prepare(vertices, scene.shadow_frame, GL_LESS);
  // Solids that extend beyond the light's box still cast shadows.
  glEnable(GL_DEPTH_CLAMP);
  glClearDepth(1);
  glClear(GL_DEPTH_BUFFER_BIT);
  DrawSolids(programs.solids_depth, scene);
  DrawMeshes(programs.meshes_depth, scene);
  DrawCloths({programs.cloth_depth, programs.lines_depth, programs.particle_balls_depth}, vertices,
             scene);
  glDisable(GL_DEPTH_CLAMP);
}

void DrawScene(const DrawPrograms& programs, const VertexArray& vertices, const DrawnScene& scene,
               const gl::DepthMap& map) {
  Prepare(vertices, scene.frame, GL_GREATER);
  glClearDepth(0);
  glClear(GL_DEPTH_BUFFER_BIT);
  glDepthFunc(GL_ALWAYS);
  glDepthMask(GL_FALSE);
  programs.backdrop.Use();
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glDepthFunc(GL_GREATER);
  glDepthMask(GL_TRUE);
  map.BindTexture(DRAPE_DRAW_UNIT_SHADOW);
  DrawSolids(programs.solids, scene);
  DrawMeshes(programs.meshes, scene);
  DrawCloths({programs.cloth, programs.lines, programs.particle_balls}, vertices, scene);
  if (scene.plane_count == 0) return;
  glEnable(GL_BLEND);
  glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
  glDepthMask(GL_FALSE);
  programs.planes.Use();
  scene.planes.BindStorage(DRAPE_DRAW_BINDING_INSTANCES);
  glDrawArraysInstanced(GL_TRIANGLES, 0, 3, static_cast<GLsizei>(scene.plane_count));
}

void DrawPlaneDepths(const DrawPrograms& programs, const DrawnScene& scene) {
  if (scene.plane_count == 0) return;
  glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  glDepthMask(GL_TRUE);
  programs.planes.Use();
  scene.planes.BindStorage(DRAPE_DRAW_BINDING_INSTANCES);
  glDrawArraysInstanced(GL_TRIANGLES, 0, 3, static_cast<GLsizei>(scene.plane_count));
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
}

Status DrawLabels(const DrawPrograms& programs, const DrawnScene& scene,
                  std::span<const shader::LabelRecord> labels) {
  if (labels.empty()) return Status::Ok();
  DRAPE_ASSIGN_OR_RETURN(const gl::Buffer buffer, UploadArray(std::vector<shader::LabelRecord>(
                                                      labels.begin(), labels.end())));
  scene.frame.BindUniforms(DRAPE_DRAW_BINDING_FRAME);
  glDisable(GL_DEPTH_TEST);
  glEnable(GL_BLEND);
  glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
  programs.labels.Use();
  buffer.BindStorage(DRAPE_DRAW_BINDING_INSTANCES);
  glDrawArraysInstanced(GL_TRIANGLES, 0, 6, static_cast<GLsizei>(labels.size()));
  return Status::Ok();
}

}  // namespace drape::render
