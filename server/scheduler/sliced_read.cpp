#include "server/scheduler/sliced_read.h"

#include <utility>
#include <variant>

namespace drape {
namespace {

// Makes room for `total` numbers with the first slice, so that none is moved again.
void Append(const ScalarColumn& slice, size_t total, ScalarColumn& all) {
  std::visit(
      [&](const auto& values) {
        using Values = std::decay_t<decltype(values)>;
        if (!std::holds_alternative<Values>(all)) all = Values();
        auto& column = std::get<Values>(all);
        if (column.empty() && !values.empty()) column.reserve(total);
        column.insert(column.end(), values.begin(), values.end());
      },
      slice);
}

}  // namespace

SlicedRead::SlicedRead(std::vector<std::shared_ptr<ClothRuntime>> cloths, StateFields fields,
                       size_t rows_per_slice)
    : cloths_(std::move(cloths)), fields_(std::move(fields)), rows_per_slice_(rows_per_slice) {
  for (size_t k = 0; k < cloths_.size(); ++k) rows_ += RowsOf(k);
}

// Of a cloth whose repair made several vertices one particle there are more.
size_t SlicedRead::RowsOf(size_t cloth) const {
  return fields_.RowsOf(cloths_[cloth]->model()->described_particle_count());
}

void SlicedRead::Begin() {
  for (const auto& cloth : cloths_) {
    states_.cloths.push_back(StampOf(*cloth));
    if (cloth->is_held()) continue;  // it is asked for twice
    cloth->Hold();
    held_.push_back(cloth.get());
  }
}

void SlicedRead::Release() {
  for (ClothRuntime* const cloth : held_) cloth->Release();
  held_.clear();
}

bool SlicedRead::ReadMore(Backend& backend) {
  size_t end = next_, rows = 0;
  while (end < cloths_.size() && (end == next_ || rows + RowsOf(end) <= rows_per_slice_)) {
    rows += RowsOf(end++);
  }
  ClothStates slice = ReadClothStates(backend, cloths().subspan(next_, end - next_), fields_);
  const bool is_all = next_ == 0 && end == cloths_.size();
  if (is_all) {  // the usual case, without a copy
    states_ = std::move(slice);
    return true;
  }
  if (next_ == 0) Begin();
  next_ = end;
  Append(slice.columns.positions_m, 3 * rows_, states_.columns.positions_m);
  Append(slice.columns.velocities_m_per_s, 3 * rows_, states_.columns.velocities_m_per_s);
  if (next_ < cloths_.size()) return false;
  Release();
  return true;
}

}  // namespace drape
