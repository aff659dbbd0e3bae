#include "server/render/gl_draw/draw_programs.h"

#include <optional>
#include <utility>

#include "server/gl/shader_source.h"
#include "shaders/embedded_shaders.h"

namespace drape::render {

namespace {

// Compiles until the first error; skips the rest.
class Compiler {
 public:
  explicit Compiler(gl::ShaderLibrary library) : library_(std::move(library)) {}

  std::optional<gl::Program> Compute(const std::string& file) {
    if (!status_.ok()) return std::nullopt;
    const Result<gl::ShaderSource> source = library_.Assemble(
        "draw/" + file, "#define LOCAL_SIZE " + std::to_string(kShadeLocalSize) + "\n");
    if (!source.ok()) return Failed(source.status());
    Result<gl::Program> program = gl::Program::Compile(source.value());
    if (!program.ok()) return Failed(program.status());
    return std::move(program).value();
  }

  std::optional<gl::Program> Draw(const std::string& vertex_file, const std::string& fragment_file,
                                  const std::string& fragment_defines = "") {
    if (!status_.ok()) return std::nullopt;
    const Result<gl::ShaderSource> vertex = library_.Assemble("draw/" + vertex_file, "");
    if (!vertex.ok()) return Failed(vertex.status());
    const Result<gl::ShaderSource> fragment =
        library_.Assemble("draw/" + fragment_file, fragment_defines);
    if (!fragment.ok()) return Failed(fragment.status());
    Result<gl::Program> program = gl::Program::CompileDraw(vertex.value(), fragment.value());
    if (!program.ok()) return Failed(program.status());
    return std::move(program).value();
  }

  const Status& status() const { return status_; }

 private:
  std::nullopt_t Failed(Status status) {
    status_ = std::move(status);
    return std::nullopt;
  }

  gl::ShaderLibrary library_;
  Status status_;
};

}  // namespace

Result<DrawPrograms> CompileDrawPrograms(const std::string& shader_dir) {
  gl::ShaderLibrary library;
  for (const EmbeddedShader& shader : EmbeddedShaders()) {
    library.Add(std::string(shader.path), std::string(shader.text));
  }
  if (!shader_dir.empty()) DRAPE_RETURN_IF_ERROR(library.AddDirectory(shader_dir));
  Compiler compiler(std::move(library));
  auto shade_vertices = compiler.Compute("shade_vertices.comp");
  auto light_particles = compiler.Compute("light_particles.comp");
  auto cloth = compiler.Draw("cloth.vert", "cloth.frag");
  auto cloth_depth = compiler.Draw("cloth.vert", "depth.frag");
  auto lit_cloth = compiler.Draw("lit_cloth.vert", "lit_cloth.frag");
  auto lines = compiler.Draw("lines.vert", "lines.frag");
  auto lines_depth = compiler.Draw("lines.vert", "depth.frag");
  auto particle_balls = compiler.Draw("particle_balls.vert", "particle_balls.frag");
  auto particle_balls_depth = compiler.Draw("particle_balls.vert", "depth.frag");
  auto solids = compiler.Draw("solids.vert", "solids.frag");
  auto solids_depth = compiler.Draw("solids.vert", "depth.frag");
  auto meshes = compiler.Draw("meshes.vert", "solids.frag");
  auto meshes_depth = compiler.Draw("meshes.vert", "depth.frag");
  auto planes = compiler.Draw("planes.vert", "planes.frag");
  auto planes_depth = compiler.Draw("planes.vert", "planes_depth.frag");
  auto labels = compiler.Draw("labels.vert", "labels.frag");
  auto pack_four = compiler.Draw("pack.vert", "pack.frag", "#define SAMPLES 4\n");
  auto pack_one = compiler.Draw("pack.vert", "pack.frag", "#define SAMPLES 1\n");
  if (!compiler.status().ok()) return compiler.status();
  return DrawPrograms{.shade_vertices = *std::move(shade_vertices),
                      .light_particles = *std::move(light_particles),
                      .cloth = *std::move(cloth),
                      .lit_cloth = *std::move(lit_cloth),
                      .cloth_depth = *std::move(cloth_depth),
                      .lines = *std::move(lines),
                      .lines_depth = *std::move(lines_depth),
                      .particle_balls = *std::move(particle_balls),
                      .particle_balls_depth = *std::move(particle_balls_depth),
                      .solids = *std::move(solids),
                      .solids_depth = *std::move(solids_depth),
                      .meshes = *std::move(meshes),
                      .meshes_depth = *std::move(meshes_depth),
                      .planes = *std::move(planes),
                      .planes_depth = *std::move(planes_depth),
                      .labels = *std::move(labels),
                      .pack_four = *std::move(pack_four),
                      .pack_one = *std::move(pack_one)};
}

}  // namespace drape::render
