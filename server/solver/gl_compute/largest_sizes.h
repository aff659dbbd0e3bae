// The lengths of the host's loops for a group of cloths. Pure.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "server/solver/gl_compute/gl_cloth.h"

namespace drape {

// The stages that a substep has in any cloth of a group.
struct SubstepWork {
  bool kicks_before = false;
  bool kicks_within = false;
  bool kicks_after = false;
  bool damps_twist = false;
  bool is_last = false;
};

// A family of elastic elements that is solved by lines, in any cloth of a group.
struct ElasticWork {
  uint32_t lines = 0;
  bool has_cells = false;
};

// The largest of each size over the cloths of a group. The surplus work groups of a smaller cloth
// return at once, so the bits of a cloth do not depend on the others.
struct LargestSizes {
  uint32_t particles = 0;
  uint32_t pins = 0;
  uint32_t triangles = 0;
  uint32_t elastic_elements = 0;
  uint32_t constraints = 0;
  uint32_t max_iterations = 0;
  uint32_t velocity_iterations = 0;
  uint32_t hinge_stages = 0;
  std::vector<SubstepWork> substeps;
  std::vector<ElasticWork> elastic_families;
  std::vector<uint32_t> phases;         // [phase] strips
  std::vector<uint32_t> phase_blocks;   // [phase] work groups that solve them from both ends
  std::vector<uint32_t> colours;        // [colour] constraints
  std::vector<uint32_t> joint_colours;  // [colour] joints
  // Most rounds of refinement that follow a sweep of a substep, by {substep, sweep}.
  std::map<std::pair<uint32_t, uint32_t>, uint32_t> refine_rounds;
};

LargestSizes FindLargest(std::span<const GlCloth* const> cloths);

}  // namespace drape
