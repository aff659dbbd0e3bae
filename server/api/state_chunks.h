// From columns in cloth frames to StateChunks in the world frame.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "drape/v1/state.pb.h"
#include "server/api/message_slices.h"
#include "server/api/sent_column.h"
#include "server/api/state_encoding.h"
#include "server/api/view_validation.h"
#include "server/core/ids.h"
#include "server/scene/placement.h"
#include "server/scheduler/step_work.h"
#include "server/session/session.h"

namespace drape::api {

// The constant part of a cloth whose state is sent.
struct ChunkCloth {
  ClothId id;
  Placement placement;
  uint32_t row_count = 0;  // of the columns that are sent, over all chunks
  uint32_t rows_read = 0;  // of the columns that are read
};
// In the same order.
std::vector<ChunkCloth> ChunkClothsOf(const ClothList& cloths, const ViewSpec& view);

// Cuts states into chunks of at most `max_data_bytes` of columns each. A cloth of too many rows for
// any chunk begins in a chunk of its own and continues in the next ones; the others are never
// split. Reductions are made by the constructor. Columns without an encoding become the world's
// where they are, and the chunks share them. Not thread-safe.
class StateChunker {
 public:
  // `cloths` and `states.cloths` are in the same order; `states` are what view.FieldsRead() asks
  // for. A chunk has at least one row.
  StateChunker(std::vector<ChunkCloth> cloths, ClothStates states, uint64_t max_data_bytes,
               const ViewSpec& view = {.fields = {.positions = true, .velocities = true}});

  // False after the last chunk. States of no cloth are one chunk without cloths.
  bool has_next() const { return !is_done_; }
  // The next StateChunk; is_last is set on the last one.
  MessageSlices Next();

 private:
  // A chunk that is made.
  struct Chunk {
    v1::StateChunk fields;              // but for the columns
    std::string positions, velocities;  // encoded
  };
  // Makes the reductions, and keeps of the columns what is sent.
  void ReduceStates(const ViewSpec& view, StateColumns& columns);
  bool is_encoded() const { return encoding_ != v1::StateView::ENCODING_UNSPECIFIED; }
  // Adds as many cloths as fit, and returns their number of rows.
  uint64_t AddCloths(Chunk& chunk);
  void AddCloth(const ChunkCloth& cloth, uint64_t row_count, Chunk& chunk);
  void AddReductions(const Reductions& reductions, v1::StateChunk* fields) const;
  void AddPositions(const ChunkCloth& cloth, uint64_t row_count, Chunk& chunk);
  void AddVelocities(uint64_t row_count, Chunk& chunk) const;

  std::vector<ChunkCloth> cloths_;
  std::vector<ClothStamp> stamps_;
  SentColumn positions_m_, velocities_m_per_s_;
  v1::StateView::Encoding encoding_;
  ReductionSpec reduction_spec_;
  std::vector<Reductions> reductions_;  // of each cloth, or empty
  uint64_t max_rows_ = 1;               // per chunk
  uint64_t max_cloths_ = 1;             // per chunk
  size_t next_cloth_ = 0;
  uint32_t next_row_of_cloth_ = 0;
  uint64_t next_row_ = 0;  // of the columns
  FixedGrid grid_;         // of the next cloth, with FIXED16
  bool is_done_ = false;
};

// Bytes of the columns that are read, which the answer holds until it is made.
uint64_t BytesRead(std::span<const ChunkCloth> cloths, ScalarType scalar, const ViewSpec& view);
// Bytes of the columns and the reductions that are sent.
uint64_t BytesSent(std::span<const ChunkCloth> cloths, ScalarType scalar, const ViewSpec& view);

}  // namespace drape::api
