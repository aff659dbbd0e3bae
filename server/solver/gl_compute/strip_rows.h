// How strips that are solved from both ends are spread over work groups
// (shaders/stages/meet_strips.glsl).
#pragma once

#include <cstdint>
#include <vector>

#include "server/scene/scene_model.h"

namespace drape {

// The strips of a phase in blocks, of which each work group takes one. Every link has a row in the
// shared memory of its group.
struct StripRows {
  uint32_t row_count = 0;              // of a block, and invocations of its group; 0: no strips
  std::vector<uint32_t> phase_blocks;  // [phase_count + 1] first block of each phase
  std::vector<uint32_t> block_strips;  // [block_count + 1] first strip of each block
  std::vector<uint32_t> rows;          // [constraint_count] the words `strip_rows` of a model
};

// Rows of the smallest work group that holds any strip: 256, 512 or 1024.
uint32_t LeastRows(const StripSet& strips);

// Whether each phase fits into one block of a resident cloth with so many rows.
bool FitsInRows(const StripSet& strips, uint32_t row_count);

// Levels of reduction after which strips are solved: a level costs as much as a few rows of an
// elimination. Each doubles the systems, of which each takes two invocations.
uint32_t StripLevels(const SceneModel& model, bool is_resident);

// Levels of reduction after which every equation is alone.
uint32_t AllStripLevels(const StripSet& strips);

// A phase is one block where the cloth is resident; else blocks have LeastRows rows and as many
// strips as fit, with two invocations for each of their systems. Pure.
StripRows FindStripRows(const SceneModel& model, bool is_resident);

}  // namespace drape
