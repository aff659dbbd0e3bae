// A column of numbers that chunks share.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>

#include "server/api/message_slices.h"
#include "server/solver/backend.h"

namespace drape::api {

// Rows of three numbers, which are shifted where they are and then sent from there. Not
// thread-safe, but for the slices, which keep the numbers alive.
class SentColumn {
 public:
  explicit SentColumn(ScalarColumn numbers = {});
  // A copy would shift the numbers that the original shares.
  SentColumn(SentColumn&&) = default;
  SentColumn& operator=(SentColumn&&) = default;

  const ScalarColumn& numbers() const { return *numbers_; }
  uint64_t row_count() const { return row_count_; }
  // Adds in double precision, then rounds to the column's type. Without a shift they stay as they
  // are. Of rows that no slice has.
  void Shift(uint64_t first_row, uint64_t row_count, const Eigen::Vector3d& shift);
  grpc::Slice Rows(uint64_t first_row, uint64_t row_count) const;

 private:
  std::shared_ptr<ScalarColumn> numbers_;
  uint64_t row_count_ = 0;
  uint64_t row_bytes_ = 0;
  grpc::Slice bytes_;
};

}  // namespace drape::api
