// A reader of USD text for tests: strict, and only for the parts that Drape writes. Anything else
// fails with std::runtime_error, which names the place.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace drape::client_test {

struct UsdaAttribute {
  std::string declaration;      // "uniform bool", "point3f[]"
  std::string value;            // of attributes without time samples: a word or string
  std::vector<float> elements;  // or the numbers of an array, tuples flattened
  std::map<double, std::vector<float>> samples;  // by time code
  std::map<std::string, std::string> metadata;
};

struct UsdaPrim {
  std::string type;
  std::string name;
  std::map<std::string, std::string> metadata;
  std::map<std::string, UsdaAttribute> attributes;  // by name
  std::vector<UsdaPrim> children;
};

struct UsdaLayer {
  std::map<std::string, std::string> metadata;
  std::vector<UsdaPrim> prims;
};

UsdaLayer ParseUsda(const std::string& text);

}  // namespace drape::client_test
