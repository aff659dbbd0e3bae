// Elastic elements in the block Models.
#ifndef DRAPE_STAGES_ELASTIC_ELEMENT_GLSL_
#define DRAPE_STAGES_ELASTIC_ELEMENT_GLSL_

#include "lib/elastic.glsl"
#include "stages/buffers.glsl"

ElasticElement LoadElement(uint e) {
  uint word = cloth.model.elastic_elements + DRAPE_ELASTIC_WORDS * e;
  ElasticElement element;
  element.particles =
      uvec4(models[word], models[word + 1u], models[word + 2u], models[word + 3u]);
  element.weights =
      vec3(ModelFloat(word + 4u), ModelFloat(word + 5u), ModelFloat(word + 6u));
  element.rest_length = ModelFloat(word + 7u);
  element.mass = ModelFloat(word + 8u);
  element.frequency_sq = ModelFloat(word + 9u);
  element.damping_share = ModelFloat(word + 10u);
  return element;
}

#endif
