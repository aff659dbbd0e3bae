// From columns in cloth frames to StateChunks in the world frame.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "drape/v1/state.pb.h"
#include "server/core/ids.h"
#include "server/scene/placement.h"
#include "server/scheduler/step_work.h"
#include "server/session/session.h"

namespace drape::api {

// The constant part of a cloth whose state is sent.
struct ChunkCloth {
  ClothId id;
  Placement placement;
  uint32_t row_count = 0;  // of its columns, over all chunks
};
// In the same order.
std::vector<ChunkCloth> ChunkClothsOf(const ClothList& cloths, const StateFields& fields);

// Cuts states into chunks of at most `max_data_bytes` of columns each. A cloth of too many rows for
// any chunk begins in a chunk of its own and continues in the next ones; the others are never
// split. Not thread-safe.
class StateChunker {
 public:
  // `cloths` and `states.cloths` are in the same order. A chunk has at least one row.
  StateChunker(std::vector<ChunkCloth> cloths, ClothStates states, uint64_t max_data_bytes);

  // False after the last chunk. States of no cloth are one chunk without cloths.
  bool has_next() const { return !is_done_; }
  // Overwrites `chunk`; is_last is set on the last one.
  void Next(v1::StateChunk* chunk);

 private:
  void AppendRows(const ChunkCloth& cloth, uint64_t first_row, uint64_t row_count,
                  v1::StateChunk* chunk) const;

  std::vector<ChunkCloth> cloths_;
  ClothStates states_;
  uint64_t max_rows_ = 1;  // per chunk
  size_t next_cloth_ = 0;
  uint32_t next_row_of_cloth_ = 0;
  uint64_t next_row_ = 0;  // of the columns
  bool is_done_ = false;
};

// Bytes of one row of the columns.
uint64_t BytesPerRow(ScalarType scalar, const StateFields& fields);
// Bytes of all columns of the cloths.
uint64_t StateBytes(std::span<const ChunkCloth> cloths, ScalarType scalar,
                    const StateFields& fields);

}  // namespace drape::api
