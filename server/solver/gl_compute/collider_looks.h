// Which steps of a cloth look for colliders out of reach. Pure.
#pragma once

#include <cstdint>

namespace drape {

// Looks in a row that found none out of reach, before the next steps do not look.
inline constexpr uint32_t kFruitlessLooks = 4;
// Steps without a look on a software renderer: half a second at 60 Hz; a look costs some per cent
// of a step there.
inline constexpr uint32_t kSoftwareLookPause = 31;

// A look pays only if it finds something. After kFruitlessLooks in vain some steps do not look,
// then one does, and so on until one finds something. A step that does not look works on all
// contacts: its bits are the same.
class ColliderLooks {
 public:
  // Whether the next step looks.
  bool is_due() const { return left_ == 0; }

  // After each step. `has_found`: it looked, and found a collider out of reach; `pause`: steps
  // without a look, 0: none.
  void AfterStep(bool has_found, uint32_t pause) {
    if (!is_due()) {
      --left_;
      return;
    }
    fruitless_ = has_found ? 0 : fruitless_ + 1;
    if (fruitless_ < kFruitlessLooks) return;
    fruitless_ = kFruitlessLooks - 1;
    left_ = pause;
  }

 private:
  uint32_t left_ = 0;  // steps of a pause
  uint32_t fruitless_ = 0;
};

}  // namespace drape
