#!/usr/bin/env python3
"""Who subscribes and never reads, publishes a hundredfold, or sends poses at 10 kHz: memory stays, the node goes on."""
import math
import struct
import time
import unittest

import rosgraph
import rospy
import rostest
from geometry_msgs.msg import PoseStamped
from tissue_sim.msg import Contacts, TissueState
from visualization_msgs.msg import MarkerArray

from running_node import (BALL_RADIUS, LONG, POSE_TOPIC, PROBE_RADIUS, RunningNode, pose_message, resident_memory,
                          stamp_of, wait_until)
from tcpros import Publisher, message_bytes, subscribe

MS = 10**6  # ns
START = 1000 * 10**9
TOUCH = BALL_RADIUS + PROBE_RADIUS
MOST_GROWTH = 2e6  # bytes, over the second half: what the allocator keeps is there by then


def pressed(i):
    """m, height of the tip: in the ball up to 3 mm, out of it again every 600 poses."""
    return TOUCH - 0.001 + 0.002 * math.cos(2 * math.pi * i / 600)


class CrowdTest(unittest.TestCase):
    def start(self, name, **parameters):
        node = RunningNode(name, **parameters)
        self.addCleanup(node.stop)
        return node

    def goes_on(self, node, stamp):
        """Takes one more pose and answers it."""
        answers = node.listen('contacts', Contacts)
        node.poses.publish(pose_message(stamp, (0, 0, TOUCH - 0.002)))
        self.assertTrue(wait_until(lambda: any(stamp_of(m) == stamp for m in answers)), node.diagnostics)

    def test_a_subscriber_that_never_reads(self):
        node = self.start('unread', state_period=0.001)
        uri = rosgraph.Master('/crowd_test').lookupNode(node.name)
        unread = [subscribe(uri, node.name + '/' + topic, kind)
                  for topic, kind in (('ball/state', TissueState), ('contacts', Contacts), ('markers', MarkerArray))]
        states = node.listen('ball/state', TissueState)
        memory = []
        count = 60000 if LONG else 1500
        for i in range(count):
            node.poses.publish(pose_message(START + i * 2 * MS, (0, 0, pressed(i))))
            time.sleep(0.002)
            if i % 100 == 0:
                memory.append(resident_memory(node.process))
        last = START + (count - 1) * 2 * MS
        self.assertTrue(wait_until(lambda: states and stamp_of(states[-1]) == last), 'others get theirs')
        grown = memory[-1] - memory[len(memory) // 2]
        print('a subscriber that never reads: %d states sent to another, memory %+.3f MB over the second half'
              % (len(states), grown / 1e6))
        self.assertLess(grown, MOST_GROWTH)
        for connection in unread:
            connection.close()
        self.goes_on(node, last + 2 * MS)

    def test_many_publishers_of_one_topic(self):
        node = self.start('crowded')
        count, rounds = (100, 600) if LONG else (20, 60)
        before = resident_memory(node.process)
        crowd = [Publisher(rosgraph.get_master_uri(), '/crowd_%d' % i, '/' + POSE_TOPIC, PoseStamped)
                 for i in range(count)]
        self.assertTrue(wait_until(lambda: all(publisher.connections for publisher in crowd)), 'all are heard')
        memory = []
        for i in range(rounds):
            for j, publisher in enumerate(crowd):
                stamp = START + (i * count + j) * MS
                publisher.send(message_bytes(pose_message(stamp, (0, 0, pressed(i)))))
            time.sleep(0.01)
            memory.append(resident_memory(node.process))
        last = START + rounds * count * MS
        for publisher in crowd:
            publisher.close()
        self.goes_on(node, last)
        grown = memory[-1] - memory[len(memory) // 2]
        print('%d publishers: memory %+.3f MB with them, %+.3f MB over the second half'
              % (count, (memory[-1] - before) / 1e6, grown / 1e6))
        self.assertLess(grown, MOST_GROWTH)
        self.assertEqual(node.diagnostics['recoveries'], '0')

    def test_poses_at_10_khz(self):
        node = self.start('fast')
        contacts = node.listen('contacts', Contacts)
        source = Publisher(rosgraph.get_master_uri(), '/fast_source', '/' + POSE_TOPIC, PoseStamped)
        self.addCleanup(source.close)
        self.assertTrue(wait_until(lambda: source.connections))
        message = bytearray(message_bytes(pose_message(START, (0, 0, TOUCH))))
        stamp_at, z_at = 8, len(message) - 5 * 8  # behind length and seq; before the quaternion
        self.assertEqual(struct.unpack_from('<d', message, z_at)[0], TOUCH)
        rate, seconds = 10000, 600 if LONG else 5
        memory, sent = [], 0
        begin = time.monotonic()
        while sent < rate * seconds:
            due = min(rate * seconds, int((time.monotonic() - begin) * rate))
            batch = bytearray()
            for i in range(sent, due):
                stamp = START + i * (10**9 // rate)
                struct.pack_into('<II', message, stamp_at, stamp // 10**9, stamp % 10**9)
                struct.pack_into('<d', message, z_at, pressed(i / 10))
                batch += message
            source.send(batch)
            if due * 10 // (rate * seconds) != sent * 10 // (rate * seconds):
                memory.append(resident_memory(node.process))
            sent = due
            time.sleep(0.0005)
        took = time.monotonic() - begin
        last = START + (sent - 1) * (10**9 // rate)
        # Newest wins: no backlog is worked off after the last pose, whatever the machine did.
        self.assertTrue(wait_until(lambda: contacts and stamp_of(contacts[-1]) == last, 2.0), node.diagnostics)
        grown = memory[-1] - memory[len(memory) // 2]
        print('%.0f poses a second for %.1f s: %d answers, memory %+.3f MB over the second half'
              % (sent / took, took, len(contacts), grown / 1e6))
        self.assertLess(grown, MOST_GROWTH)
        stamps = [stamp_of(m) for m in contacts]
        self.assertEqual(stamps, sorted(stamps))
        self.assertEqual(node.diagnostics['new_runs'], '0')
        self.assertEqual(node.diagnostics['recoveries'], '0')


if __name__ == '__main__':
    rospy.init_node('crowd_test')
    rostest.rosrun('tissue_sim', 'crowd_test', CrowdTest)
