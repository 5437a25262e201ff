#!/usr/bin/env python3
"""What is killed comes back: the node at random moments, its master, and the output bag of a replay."""
import glob
import math
import os
import random
import shutil
import signal
import socket
import subprocess
import tempfile
import time
import unittest
import xmlrpc.client

import rosbag
import rospy
import rostest
from geometry_msgs.msg import PoseStamped
from tissue_sim.msg import TissueState, TissueTopology

from running_node import (BALL_RADIUS, LONG, POSE_TOPIC, PROBE_RADIUS, SPHERE_SCENE, RunningNode, pose_message, program,
                          wait_until)
from tcpros import Publisher, message_bytes, subscribe

MS = 10**6  # ns
START = 1000 * 10**9
TOUCH = BALL_RADIUS + PROBE_RADIUS
PATIENCE = 20.0  # s; a busy machine is not what is looked for


def free_port():
    with socket.socket() as probe:
        probe.bind(('127.0.0.1', 0))
        return probe.getsockname()[1]


class KilledNodeTest(unittest.TestCase):
    def test_it_is_ready_again(self):
        chance = random.Random(1)
        topologies, states = [], []
        rospy.Subscriber('/killed/ball/topology', TissueTopology, topologies.append)
        rospy.Subscriber('/killed/ball/state', TissueState, states.append)
        poses = rospy.Publisher(POSE_TOPIC, PoseStamped, queue_size=10)
        command = [program('tissue_sim_node'), '__name:=killed', '_scene:=' + SPHERE_SCENE, '_state_period:=0.001']
        ready, process = [], None
        self.addCleanup(lambda: process.kill())
        stamp = START
        for _ in range(201 if LONG else 4):
            if process:
                moment = time.monotonic() + chance.uniform(0.0, 0.3)
                while time.monotonic() < moment:  # in the middle of its work
                    stamp += 5 * MS
                    poses.publish(pose_message(stamp, (0, 0, TOUCH - 0.002)))
                    time.sleep(0.002)
                process.send_signal(signal.SIGKILL)
                process.wait()
                time.sleep(0.05)  # what was on the wire has come
            del topologies[:], states[:]
            begin = time.monotonic()
            process = subprocess.Popen(command)
            # Ready: it has heard a pose and shown the organ pressed.
            while not states and time.monotonic() < begin + PATIENCE:
                stamp += 5 * MS
                poses.publish(pose_message(stamp, (0, 0, TOUCH - 0.002)))
                time.sleep(0.005)
            ready.append(time.monotonic() - begin)
            self.assertTrue(states, 'no state after %.0f s' % PATIENCE)
            self.assertTrue(wait_until(lambda: topologies))
            first, topology = states[0], topologies[0]
            self.assertEqual(first.topology_id, topology.topology_id)
            self.assertEqual(len(first.positions), len(topology.rest_positions))
            self.assertEqual(3 * len(first.depths), len(first.positions))
            self.assertTrue(all(map(math.isfinite, first.positions)) and all(map(math.isfinite, first.depths)))
            self.assertEqual(first.step, 1)
            self.assertGreater(max(first.depths), 0.001)
        ready.sort()
        print('killed %d times: from its start to its first state %.2f s in the middle, %.2f s at most'
              % (len(ready) - 1, ready[len(ready) // 2], ready[-1]))


class KilledMasterTest(unittest.TestCase):
    def start_master(self):
        # A session of its own: its end must not be this test's.
        self.master = subprocess.Popen(['rosmaster', '--core', '-p', str(self.port)], stdout=subprocess.DEVNULL,
                                       stderr=subprocess.DEVNULL, start_new_session=True)
        self.assertTrue(wait_until(lambda: self.ask('getPid')[0] == 1), 'the master is up')

    def ask(self, method, *words):
        try:
            return getattr(xmlrpc.client.ServerProxy(self.uri), method)('/asking', *words)
        except (OSError, xmlrpc.client.Error):
            return [-1, 'no master', None]

    def kill_master(self):
        os.killpg(self.master.pid, signal.SIGKILL)
        self.master.wait()

    def registered(self, kind):
        """Topics or services of which the master knows that the node has them."""
        state = self.ask('getSystemState')[2] or [[], [], []]
        return {name for name, nodes in state[kind] if '/kept' in nodes}

    def test_the_node_outlives_it_and_is_found_again(self):
        self.port = free_port()
        self.uri = 'http://localhost:%d' % self.port
        self.start_master()
        self.addCleanup(self.kill_master)
        environment = dict(os.environ, ROS_MASTER_URI=self.uri)
        output = tempfile.TemporaryFile('w+')
        node = subprocess.Popen([program('tissue_sim_node'), '__name:=kept', '_scene:=' + SPHERE_SCENE,
                                 '_state_period:=0.001'], env=environment, stdout=output, stderr=output)
        self.addCleanup(node.kill)
        services = {'/kept/reset', '/kept/get_topology', '/kept/get_loggers', '/kept/set_logger_level'}
        self.assertTrue(wait_until(lambda: self.registered(2) >= services))
        everything = [self.registered(kind) for kind in range(3)]
        self.assertIn('/kept/ball/state', everything[0])
        self.assertIn('/' + POSE_TOPIC, everything[1])
        node_uri = self.ask('lookupNode', '/kept')[2]
        source = Publisher(self.uri, '/source', '/' + POSE_TOPIC, PoseStamped)
        self.addCleanup(source.connections.clear)
        self.assertTrue(wait_until(lambda: source.connections))
        listener = subscribe(node_uri, '/kept/ball/state', TissueState)
        self.addCleanup(listener.close)
        listener.settimeout(PATIENCE)

        def answers(publisher, stamp):
            publisher.send(message_bytes(pose_message(stamp, (0, 0, TOUCH - 0.002))))
            self.assertGreater(len(listener.recv(65536)), 0)

        answers(source, START)
        for time_around in range(5 if LONG else 1):
            self.kill_master()
            time.sleep(1.5)
            answers(source, START + (10 * time_around + 1) * MS)  # what is connected goes on without it
            self.start_master()
            self.assertTrue(wait_until(lambda: [self.registered(kind) for kind in range(3)] == everything),
                            [self.registered(kind) ^ everything[kind] for kind in range(3)])
            # The old source, which the new master does not know, is still heard; and a new one is found.
            answers(source, START + (10 * time_around + 2) * MS)
            another = Publisher(self.uri, '/another', '/' + POSE_TOPIC, PoseStamped)
            self.assertTrue(wait_until(lambda: another.connections), 'the node hears of a new publisher')
            answers(another, START + (10 * time_around + 3) * MS)
            another.close()
            asked = subprocess.check_output(['rosservice', 'call', '/kept/get_topology', 'ball'], env=environment,
                                            timeout=60, universal_newlines=True)
            self.assertIn('success: True', asked)
            # roscpp lets go of a publisher that the master does not name.
            source.close()
            source = Publisher(self.uri, '/source', '/' + POSE_TOPIC, PoseStamped)
            self.assertTrue(wait_until(lambda: source.connections))
        node.send_signal(signal.SIGINT)
        self.assertEqual(node.wait(PATIENCE), 0)
        output.seek(0)
        said = output.read()
        self.assertIn('does not answer', said)
        self.assertIn('registered again', said)
        self.assertLess(len(said.splitlines()), 40, said)


class KilledReplayTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.folder)

    def replay(self, out):
        """The bundled demonstration: some seconds."""
        config = os.path.join(os.path.dirname(SPHERE_SCENE), '../../config')
        return subprocess.Popen([program('tissue_sim_replay'), config + '/scenes/demo.yaml', config + '/demo.bag', out],
                                stdout=subprocess.DEVNULL)

    def test_its_bag_is_whole_or_can_be_reindexed(self):
        chance = random.Random(2)
        recovered = []
        for i in range(40 if LONG else 2):
            out = os.path.join(self.folder, 'out%d.bag' % i)
            process = self.replay(out)
            unfinished = out + '.unfinished'
            # Never before there is anything in it, sometimes after its end.
            self.assertTrue(wait_until(lambda: os.path.exists(out) or (
                os.path.exists(unfinished) and os.path.getsize(unfinished) > 10**6), 60))
            time.sleep(chance.uniform(0.0, 4.0))
            process.kill()
            process.wait()
            if os.path.exists(out):
                self.assertFalse(os.path.exists(unfinished))
                with rosbag.Bag(out) as bag:
                    recovered.append(bag.get_message_count())
                continue
            cut = os.path.join(self.folder, 'cut%d.bag' % i)
            os.rename(unfinished, cut)
            subprocess.check_output(['rosbag', 'reindex', '--quiet', cut], stderr=subprocess.STDOUT)
            with rosbag.Bag(cut) as bag:
                count = 0
                for topic, message, _ in bag.read_messages():
                    count += 1
                    if topic.endswith('/state'):
                        self.assertTrue(all(map(math.isfinite, message.positions[:30])))
            self.assertGreater(count, 10)
            recovered.append(count)
            for path in glob.glob(os.path.join(self.folder, 'cut*')):
                os.remove(path)
        print('messages read from the bags of killed replays: %s' % recovered)


if __name__ == '__main__':
    rospy.init_node('restart_test')
    rostest.rosrun('tissue_sim', 'restart_test', '__main__')
