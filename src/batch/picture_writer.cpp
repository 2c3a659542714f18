#include "batch/picture_writer.hpp"

#include <utility>

#include "base/clock.hpp"
#include "picture/picture_file.hpp"

namespace clerestory {

PictureWriter::PictureWriter(Done done)
    : done_(std::move(done)), thread_([this](const std::stop_token& stopping) { run(stopping); }) {}

void PictureWriter::write(FinishedPicture picture) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return !waiting_ && !busy_; });
    waiting_ = std::move(picture);
    changed_.notify_all();
}

void PictureWriter::finish() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return !waiting_ && !busy_; });
}

void PictureWriter::run(const std::stop_token& stopping) {
    std::unique_lock lock(mutex_);
    // What was handed over is written even when nobody waits for it.
    while (changed_.wait(lock, stopping, [&] { return waiting_.has_value(); }) || waiting_) {
        {
            busy_ = true;
            const FinishedPicture picture = std::move(*std::exchange(waiting_, std::nullopt));
            lock.unlock();
            const Stopwatch watch;
            std::exception_ptr failure;
            try {
                for (const auto& output : picture.job->outputs) {
                    write_picture(output, picture.picture, picture.preview, picture.header, picture.text);
                }
            } catch (...) {
                failure = std::current_exception();
            }
            done_(picture, watch.seconds(), failure);
        }
        lock.lock();
        busy_ = false;
        changed_.notify_all();
    }
}

}  // namespace clerestory
