// The compiled programs of the renderer.
#pragma once

#include <epoxy/gl.h>

#include <string>

#include "server/core/status.h"
#include "server/gl/program.h"

namespace drape::render {

// Invocations per work group of the compute programs.
inline constexpr GLuint kShadeLocalSize = 64;

// `*_depth`: the same vertices, only the depth.
struct DrawPrograms {
  gl::Program shade_vertices;
  gl::Program light_particles;
  gl::Program cloth;
  gl::Program lit_cloth;
  gl::Program cloth_depth;
  gl::Program lines;
  gl::Program lines_depth;
  gl::Program particle_balls;
  gl::Program particle_balls_depth;
  gl::Program solids;
  gl::Program solids_depth;
  gl::Program meshes;
  gl::Program meshes_depth;
  gl::Program planes;
  gl::Program planes_depth;
  gl::Program labels;
  gl::Program pack_four;  // samples per pixel
  gl::Program pack_one;
};

// `shader_dir`: files that replace the embedded ones; empty: none. Needs a current context.
// INTERNAL (SHADER_COMPILE_FAILED), NOT_FOUND (SHADER_DIR_NOT_FOUND, SHADER_DIR_UNUSED).
Result<DrawPrograms> CompileDrawPrograms(const std::string& shader_dir);

}  // namespace drape::render
