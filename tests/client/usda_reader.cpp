#include "tests/client/usda_reader.h"

#include <charconv>
#include <stdexcept>
#include <string_view>

namespace drape::client_test {
namespace {

class Parser {
 public:
  explicit Parser(const std::string& text) : text_(text) {}

  UsdaLayer Layer() {
    constexpr std::string_view kMagic = "#usda 1.0\n";
    if (!text_.starts_with(kMagic)) Fail("no #usda 1.0");
    at_ = kMagic.size();
    UsdaLayer layer;
    if (TakeIf('(')) layer.metadata = Metadata();
    while (!IsAtEnd()) {
      if (Word() != "def") Fail("no prim");
      layer.prims.push_back(Prim());
    }
    return layer;
  }

 private:
  [[noreturn]] void Fail(const std::string& what) const {
    throw std::runtime_error(what + " at \"" + text_.substr(at_, 40) + "\"");
  }

  void SkipSpace() { at_ = std::min(text_.find_first_not_of(" \n", at_), text_.size()); }
  bool IsAtEnd() {
    SkipSpace();
    return at_ == text_.size();
  }
  char Peek() {
    if (IsAtEnd()) Fail("the end");
    return text_[at_];
  }
  bool TakeIf(char wanted) {
    if (IsAtEnd() || text_[at_] != wanted) return false;
    ++at_;
    return true;
  }
  void Take(char wanted) {
    if (!TakeIf(wanted)) Fail(std::string("no ") + wanted);
  }

  // A name, a type or a bare number.
  std::string Word() {
    SkipSpace();
    const size_t end = text_.find_first_of(" \n(){}=\",", at_);
    if (end == std::string::npos || end == at_) Fail("no word");
    const std::string word = text_.substr(at_, end - at_);
    at_ = end;
    return word;
  }
  std::string String() {
    Take('"');
    const size_t end = text_.find_first_of("\"\n", at_);
    if (end == std::string::npos || text_[end] != '"') Fail("no end of a string");
    const std::string value = text_.substr(at_, end - at_);
    at_ = end + 1;
    return value;
  }
  template <class Type>
  Type Number() {
    SkipSpace();
    Type number = 0;
    const auto [end, error] =
        std::from_chars(text_.data() + at_, text_.data() + text_.size(), number);
    if (error != std::errc()) Fail("no number");
    at_ = static_cast<size_t>(end - text_.data());
    return number;
  }

  // [1, 2] or [(1, 2, 3), (4, 5, 6)]
  std::vector<float> Array() {
    std::vector<float> elements;
    Take('[');
    if (TakeIf(']')) return elements;
    do {
      if (!TakeIf('(')) {
        elements.push_back(Number<float>());
        continue;
      }
      for (int axis = 0; axis < 3; ++axis) {
        if (axis > 0) Take(',');
        elements.push_back(Number<float>());
      }
      Take(')');
    } while (TakeIf(','));
    Take(']');
    return elements;
  }

  // After its "(": name = value lines.
  std::map<std::string, std::string> Metadata() {
    std::map<std::string, std::string> metadata;
    while (!TakeIf(')')) {
      const std::string name = Word();
      Take('=');
      const std::string value = Peek() == '"' ? String() : Word();
      if (!metadata.emplace(name, value).second) Fail(name + " again");
    }
    return metadata;
  }

  std::map<double, std::vector<float>> Samples() {
    std::map<double, std::vector<float>> samples;
    Take('{');
    while (!TakeIf('}')) {
      const double time = Number<double>();
      Take(':');
      if (!samples.emplace(time, Array()).second) Fail("a time again");
      Take(',');
    }
    return samples;
  }

  void Attribute(std::string declaration, UsdaPrim* prim) {
    if (declaration == "uniform") declaration += " " + Word();
    std::string name = Word();
    const bool is_sampled = name.ends_with(".timeSamples");
    if (is_sampled) name.erase(name.rfind('.'));
    UsdaAttribute attribute;
    attribute.declaration = std::move(declaration);
    Take('=');
    if (is_sampled) {
      attribute.samples = Samples();
    } else if (Peek() == '[') {
      attribute.elements = Array();
    } else {
      attribute.value = Peek() == '"' ? String() : Word();
    }
    if (TakeIf('(')) attribute.metadata = Metadata();
    if (!prim->attributes.emplace(name, std::move(attribute)).second) Fail(name + " again");
  }

  // After its "def".
  UsdaPrim Prim() {
    UsdaPrim prim;
    prim.type = Word();
    prim.name = String();
    if (TakeIf('(')) prim.metadata = Metadata();
    Take('{');
    while (!TakeIf('}')) {
      std::string word = Word();
      if (word == "def") {
        prim.children.push_back(Prim());
      } else {
        Attribute(std::move(word), &prim);
      }
    }
    return prim;
  }

  const std::string& text_;
  size_t at_ = 0;
};

}  // namespace

UsdaLayer ParseUsda(const std::string& text) {
  return Parser(text).Layer();
}

}  // namespace drape::client_test
