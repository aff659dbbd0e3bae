#include "server/solver/gl_compute/strip_rows.h"

#include <algorithm>
#include <bit>

#include "server/solver/gl_compute/kernel_costs.h"

namespace drape {

namespace {

uint32_t LinksOf(const StripSet& strips, uint32_t first_strip, uint32_t end_strip) {
  return strips.strip_offsets[end_strip] - strips.strip_offsets[first_strip];
}

// Invocations that eliminate so many strips.
uint64_t HalvesOf(uint32_t strip_count, uint32_t levels) {
  return uint64_t{2} * strip_count << levels;
}

// The end of the block that begins with this strip of a phase.
uint32_t EndOfBlock(const StripSet& strips, uint32_t first, uint32_t end_of_phase,
                    uint32_t row_count, uint32_t levels) {
  uint32_t end = first + 1;
  while (end < end_of_phase && LinksOf(strips, first, end + 1) <= row_count &&
         HalvesOf(end + 1 - first, levels) <= row_count) {
    ++end;
  }
  return end;
}

uint32_t MostStrips(const StripSet& strips) {
  uint32_t most = 0;
  for (uint32_t phase = 0; phase < strips.phase_count(); ++phase) {
    most = std::max(most, strips.phase_offsets[phase + 1] - strips.phase_offsets[phase]);
  }
  return most;
}

// `places`: that a block has for its rows. Invocations that each take a strip meet in the same bank
// of shared memory if strips are an even number of rows apart.
void AppendRows(const StripSet& strips, uint32_t first_strip, uint32_t end_strip, uint32_t places,
                std::vector<uint32_t>& rows) {
  const uint32_t strip_count = end_strip - first_strip;
  const bool has_room = LinksOf(strips, first_strip, end_strip) + strip_count <= places;
  uint32_t row = 0;
  for (uint32_t s = first_strip; s < end_strip; ++s) {
    const uint32_t links = LinksOf(strips, s, s + 1);
    for (uint32_t k = 0; k < links; ++k) rows.push_back(k | (links - 1) << 10 | (row + k) << 20);
    row += has_room && links % 2 == 0 ? links + 1 : links;
  }
}

}  // namespace

uint32_t LeastRows(const StripSet& strips) {
  const uint64_t longest = LongestStrip(strips);
  uint32_t rows = 256;
  while (rows < longest) rows *= 2;
  return rows;
}

bool FitsInRows(const StripSet& strips, uint32_t row_count) {
  for (uint32_t phase = 0; phase < strips.phase_count(); ++phase) {
    const uint32_t first = strips.phase_offsets[phase], end = strips.phase_offsets[phase + 1];
    if (LinksOf(strips, first, end) > row_count) return false;
  }
  return HalvesOf(MostStrips(strips), 0) <= row_count;
}

uint32_t StripLevels(const SceneModel& model, bool is_resident) {
  constexpr uint64_t kRowsOfSystem = 16;
  const StripSet& strips = model.strips();
  const uint64_t longest = LongestStrip(strips);
  const uint32_t invocations = is_resident ? model.particle_count() : LeastRows(strips);
  const uint32_t strips_of_block = is_resident ? MostStrips(strips) : 1;
  uint32_t levels = 0;
  while (longest >> levels > kRowsOfSystem &&
         HalvesOf(strips_of_block, levels + 1) <= invocations) {
    ++levels;
  }
  return levels;
}

uint32_t AllStripLevels(const StripSet& strips) {
  const uint64_t longest = std::max<uint64_t>(LongestStrip(strips), 1);
  return static_cast<uint32_t>(std::bit_width(longest - 1));
}

StripRows FindStripRows(const SceneModel& model, bool is_resident) {
  const StripSet& strips = model.strips();
  StripRows rows;
  rows.row_count = is_resident ? model.particle_count() : LeastRows(strips);
  const uint32_t levels = StripLevels(model, is_resident);
  const uint32_t places = rows.row_count + rows.row_count / 32;
  for (uint32_t phase = 0; phase < strips.phase_count(); ++phase) {
    rows.phase_blocks.push_back(static_cast<uint32_t>(rows.block_strips.size()));
    const uint32_t end = strips.phase_offsets[phase + 1];
    for (uint32_t first = strips.phase_offsets[phase]; first < end;) {
      const uint32_t end_of_block =
          is_resident ? end : EndOfBlock(strips, first, end, rows.row_count, levels);
      rows.block_strips.push_back(first);
      AppendRows(strips, first, end_of_block, places, rows.rows);
      first = end_of_block;
    }
  }
  rows.phase_blocks.push_back(static_cast<uint32_t>(rows.block_strips.size()));
  rows.block_strips.push_back(strips.strip_count());
  return rows;
}

}  // namespace drape
