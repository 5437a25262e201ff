#!/usr/bin/env python3
"""A bag that rosbag plays over and over: each time a new run with the same answers, and no memory kept."""
import math
import os
import shutil
import signal
import subprocess
import tempfile
import unittest

import rosbag
import rospy
import rostest
from tissue_sim.msg import Contacts

from running_node import (BALL_RADIUS, LONG, POSE_TOPIC, PROBE_RADIUS, RunningNode, pose_message, resident_memory,
                          stamp_of, wait_until)

START = 1000 * 10**9  # ns
POSES = 60
SPACING = 12 * 10**6  # ns; the whole is longer than the threshold of a new run, 0.5 s
LAST = START + (POSES - 1) * SPACING
TOUCH = BALL_RADIUS + PROBE_RADIUS
MOST_GROWTH = 2e6  # bytes, over the second half


class LoopTest(unittest.TestCase):
    def test_each_loop_is_the_first(self):
        folder = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, folder)
        path = os.path.join(folder, 'press.bag')
        with rosbag.Bag(path, 'w') as bag:
            for i in range(POSES):
                z = TOUCH + 0.001 - 0.004 * math.sin(0.9 * math.pi * i / (POSES - 1))
                message = pose_message(START + i * SPACING, (0.001, 0, z))
                bag.write('/' + POSE_TOPIC, message, message.header.stamp)

        node = RunningNode('looped', keep_all_poses='true')
        self.addCleanup(node.stop)
        answers, memory = [], []

        def take(message):
            if stamp_of(message) == LAST:
                answers.append([(c.triangle, c.barycentric, c.depth, c.force.x, c.force.y, c.force.z)
                                for c in message.contacts])
                memory.append(resident_memory(node.process))

        subscriber = rospy.Subscriber(node.name + '/contacts', Contacts, take, queue_size=10000)
        self.assertTrue(wait_until(lambda: subscriber.get_num_connections() > 0))
        loops, rate = (1000, 10) if LONG else (20, 10)
        # A player that was held up catches up in one burst, of which its usual queue of 100 may lose the oldest.
        player = subprocess.Popen(['rosbag', 'play', '--quiet', '--loop', '--delay=1', '--rate=%d' % rate,
                                   '--queue=%d' % (loops * POSES), path],
                                  stdin=subprocess.DEVNULL, start_new_session=True)
        try:
            done = wait_until(lambda: len(answers) >= loops or player.poll() is not None, 60 + loops)
        finally:
            os.killpg(player.pid, signal.SIGINT)
            player.wait(10)
        self.assertTrue(done and len(answers) >= loops, '%d loops; %s' % (len(answers), node.diagnostics))
        grown = memory[loops - 1] - memory[loops // 2]
        print('%d loops, memory %+.3f MB over the second half' % (loops, grown / 1e6))
        self.assertGreater(len(answers[0]), 0)
        others = [i for i, answer in enumerate(answers) if answer != answers[0]]
        self.assertEqual(others, [], 'every loop ends with the same contacts; %s' % node.diagnostics)
        self.assertLess(grown, MOST_GROWTH)
        self.assertTrue(wait_until(lambda: int(node.diagnostics['new_runs']) >= loops - 1), node.diagnostics)
        self.assertEqual(node.diagnostics['recoveries'], '0')


if __name__ == '__main__':
    rospy.init_node('loop_test')
    rostest.rosrun('tissue_sim', 'loop_test', LoopTest)
