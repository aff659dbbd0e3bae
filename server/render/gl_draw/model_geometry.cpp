#include "server/render/gl_draw/model_geometry.h"

#include <bit>
#include <span>

#include "shaders/interface/draw_bindings.h"

namespace drape::render {

namespace {

// Turns counts[p + 1] into offsets: the entries of p are offsets[p] .. offsets[p + 1].
void SumUp(std::span<uint32_t> counts) {
  for (size_t p = 1; p < counts.size(); ++p) counts[p] += counts[p - 1];
}

// The triangles around each particle: offsets, then the two other corners of each triangle, in its
// sense of rotation.
void BuildSurface(const SceneModel& model, ModelGeometry& geometry) {
  const auto triangles = model.triangles();
  if (triangles.empty()) return;
  const size_t offset_count = size_t{model.particle_count()} + 1;
  geometry.layout.corners = static_cast<uint32_t>(offset_count);
  std::vector<uint32_t>& words = geometry.surface;
  words.resize(offset_count + DRAPE_DRAW_CORNER_WORDS * 3 * triangles.size());
  const std::span<uint32_t> offsets(words.data(), offset_count);
  for (const auto& triangle : triangles) {
    for (const uint32_t particle : triangle) ++offsets[particle + 1];
  }
  SumUp(offsets);
  std::vector<uint32_t> next(offsets.begin(), offsets.end() - 1);
  for (const auto& triangle : triangles) {
    for (size_t corner = 0; corner < 3; ++corner) {
      const size_t entry = next[triangle[corner]]++;
      const size_t word = offset_count + DRAPE_DRAW_CORNER_WORDS * entry;
      words[word] = triangle[(corner + 1) % 3];
      words[word + 1] = triangle[(corner + 2) % 3];
    }
    geometry.indices.insert(geometry.indices.end(), triangle.begin(), triangle.end());
  }
}

uint32_t RestLengthBits(const DistanceConstraint& constraint) {
  return std::bit_cast<uint32_t>(static_cast<float>(constraint.rest_length_m));
}

uint32_t KindBits(ConstraintKind kind) {
  if (kind == ConstraintKind::kAtMost) return DRAPE_DRAW_KIND_AT_MOST;
  if (kind == ConstraintKind::kAtLeast) return DRAPE_DRAW_KIND_AT_LEAST;
  return 0;
}

void BuildConstraints(const SceneModel& model, ModelGeometry& geometry) {
  const auto constraints = model.constraints();
  const size_t offset_count = size_t{model.particle_count()} + 1;
  GeometryLayout& layout = geometry.layout;
  layout.ends = static_cast<uint32_t>(offset_count);
  layout.constraints =
      static_cast<uint32_t>(layout.ends + DRAPE_DRAW_END_WORDS * 2 * constraints.size());
  layout.pins =
      static_cast<uint32_t>(layout.constraints + DRAPE_DRAW_CONSTRAINT_WORDS * constraints.size());
  std::vector<uint32_t>& words = geometry.constraints;
  words.resize(layout.pins);
  const std::span<uint32_t> offsets(words.data(), offset_count);
  for (const DistanceConstraint& constraint : constraints) {
    ++offsets[constraint.i + 1];
    ++offsets[constraint.j + 1];
  }
  SumUp(offsets);
  std::vector<uint32_t> next(offsets.begin(), offsets.end() - 1);
  uint32_t colour = 0;
  for (uint32_t k = 0; k < constraints.size(); ++k) {
    while (k >= model.colour_offsets()[colour + 1]) ++colour;
    const DistanceConstraint& constraint = constraints[k];
    for (const auto& [particle, other] :
         {std::pair(constraint.i, constraint.j), std::pair(constraint.j, constraint.i)}) {
      const size_t word = layout.ends + DRAPE_DRAW_END_WORDS * next[particle]++;
      words[word] = other | KindBits(constraint.kind);
      words[word + 1] = RestLengthBits(constraint);
    }
    const size_t word = layout.constraints + DRAPE_DRAW_CONSTRAINT_WORDS * k;
    words[word] = constraint.i;
    words[word + 1] = constraint.j;
    words[word + 2] = colour;
  }
  words.insert(words.end(), model.pins().begin(), model.pins().end());
}

}  // namespace

ModelGeometry BuildGeometry(const SceneModel& model) {
  ModelGeometry geometry;
  BuildSurface(model, geometry);
  BuildConstraints(model, geometry);
  return geometry;
}

}  // namespace drape::render
