#include "client/src/state_decoding.h"

#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <utility>

#include "client/src/errors.h"

namespace drape {
inline namespace client {
namespace {

bool IsEncoded(const v1::PackedArray& array) {
  return array.data_type() == v1::PackedArray::FLOAT16 ||
         array.data_type() == v1::PackedArray::INT16;
}

// Puts origin + step * number, as floats, in the place of the numbers. `affine_of(k)`: of cloth k.
template <class AffineOf>
void Decode(const v1::StateChunk& chunk, AffineOf affine_of, v1::PackedArray* array) {
  uint64_t row_count = 0;
  for (const uint32_t count : chunk.particle_counts()) row_count += count;
  if (array->data().size() != row_count * 3 * sizeof(uint16_t)) {
    throw MalformedStates("whose encoded rows do not fit the particle counts");
  }
  const bool is_half = array->data_type() == v1::PackedArray::FLOAT16;
  std::string floats(row_count * 3 * sizeof(float), '\0');
  const char* from = array->data().data();
  char* to = floats.data();
  for (int cloth = 0; cloth < chunk.particle_counts_size(); ++cloth) {
    const auto [origin, step] = affine_of(cloth);
    for (uint64_t k = 0; k < 3 * uint64_t{chunk.particle_counts(cloth)}; ++k) {
      uint16_t bits;
      std::memcpy(&bits, from, sizeof(bits));
      const double number = is_half ? double{FloatOfHalf(bits)} : static_cast<int16_t>(bits);
      const auto value = static_cast<float>((origin ? origin[k % 3] : 0) + step * number);
      std::memcpy(to, &value, sizeof(value));
      from += sizeof(bits);
      to += sizeof(value);
    }
  }
  *array->mutable_data() = std::move(floats);
  array->set_data_type(v1::PackedArray::FLOAT32);
}

}  // namespace

Error MalformedStates(const std::string& what) {
  return LocalError(ErrorCode::kInternal, "MALFORMED_STATES", "the server sent states " + what);
}

float FloatOfHalf(uint16_t half) {
  const int exponent = (half >> 10) & 31;
  const int fraction = half & 1023;
  float magnitude = 0;
  if (exponent == 31) {
    magnitude = fraction == 0 ? std::numeric_limits<float>::infinity()
                              : std::numeric_limits<float>::quiet_NaN();
  } else {
    magnitude = exponent == 0 ? std::ldexp(static_cast<float>(fraction), -24)
                              : std::ldexp(static_cast<float>(fraction + 1024), exponent - 25);
  }
  return half >> 15 ? -magnitude : magnitude;
}

void DecodeStates(v1::StateChunk* chunk) {
  const int cloth_count = chunk->particle_counts_size();
  if (IsEncoded(chunk->positions_m())) {
    const bool has_steps = chunk->positions_m().data_type() == v1::PackedArray::INT16;
    if (chunk->origins_m_size() != 3 * cloth_count ||
        chunk->position_steps_m_size() != (has_steps ? cloth_count : 0)) {
      throw MalformedStates("whose encoded positions have no origin or step");
    }
    const auto affine_of = [&](int cloth) {
      return std::pair(chunk->origins_m().data() + 3 * ptrdiff_t{cloth},
                       has_steps ? chunk->position_steps_m(cloth) : 1.0);
    };
    Decode(*chunk, affine_of, chunk->mutable_positions_m());
  }
  if (IsEncoded(chunk->velocities_m_per_s())) {
    const auto affine_of = [](int) { return std::pair(static_cast<const double*>(nullptr), 1.0); };
    Decode(*chunk, affine_of, chunk->mutable_velocities_m_per_s());
  }
  chunk->clear_origins_m();
  chunk->clear_position_steps_m();
}

}  // namespace client
}  // namespace drape
