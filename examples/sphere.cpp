// Lights a sphere with a map: sphere OUTPUT.{exr,png} [MAP]. Without a map, the bundled one.
#include <algorithm>
#include <clerestory/clerestory.hpp>
#include <cstdio>

int main(int argc, char** argv) {
    if (argc < 2) {
        std::fprintf(stderr, "usage: sphere OUTPUT.{exr,png} [MAP]\n");
        return 2;
    }
    try {
        // A device, a map on it, and the map's sampling tables.
        clerestory::Engine engine;
        const auto environment =
            engine.environment(clerestory::read_map(argc > 2 ? argv[2] : clerestory::bundled_map()));

        // 256 samples by hand: the light that falls on a surface that faces up.
        double irradiance = 0;
        for (const auto& sample : engine.draw(environment, 256).records()) {
            const double intensity = (sample.rgb[0] + sample.rgb[1] + sample.rgb[2]) / 3.0;
            irradiance += intensity * std::max(0.0F, sample.direction[1]) / sample.pdf / 256;
        }
        std::printf("%s: irradiance from above %.4g\n", engine.device().name.c_str(), irradiance);

        // The sphere, exactly.
        engine.write(argv[1], engine.render(environment, {.estimator = clerestory::Estimator::exact, .size = 255}));
    } catch (const clerestory::Error& error) {
        std::fprintf(stderr, "sphere: %s\n", error.what());
        return error.exit_code();
    }
}
