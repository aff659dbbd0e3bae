#include "server/solver/gl_compute/kernel_traits.h"

#include <algorithm>

namespace drape {

namespace {

std::string DefineOf(std::string_view name) {
  return "HAS_" + UpperCase(name);
}

}  // namespace

std::string UpperCase(std::string_view name) {
  std::string upper(name);
  std::ranges::transform(upper, upper.begin(), [](char letter) {
    return letter >= 'a' && letter <= 'z' ? static_cast<char>(letter - 'a' + 'A') : letter;
  });
  return upper;
}

const std::array<std::string, KernelTrait::kCount>& TraitDefines() {
  static const auto& defines = *new std::array<std::string, KernelTrait::kCount>([] {
    std::array<std::string, KernelTrait::kCount> all;
    std::string* next = all.data();
    for (const std::string_view name : kStageNames) *next++ = DefineOf(name);
    for (const std::string_view name : kFeatureNames) *next++ = DefineOf(name);
    for (const std::string_view name : kShapeNames) *next++ = DefineOf(name);
    return all;
  }());
  return defines;
}

std::string TraitSet::Defines() const {
  std::string text;
  for (uint32_t number = 0; number < KernelTrait::kCount; ++number) {
    if ((bits_ >> number & 1) != 0) text += "#define " + TraitDefines()[number] + "\n";
  }
  return text;
}

}  // namespace drape
